"""What a notebook shows: scenes and runs of the engine as the website's replay, traces and histories as its charts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from spook_tracker.engine.check import nearest
from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.result import Result, columns_of
from spook_tracker.engine.scene import Scene
from spook_tracker.tracker.document.errors import UnknownName
from spook_tracker.tracker.store.history import History, SeriesHistory
from spook_tracker.tracker.store.versions import unknown_test
from spook_tracker.tracker.website.charts import Chart, Line
from spook_tracker.tracker.website.diagrams import ladder_charts, trend_chart
from spook_tracker.tracker.website.nights import Chapter, TestHistory, Trend, book
from spook_tracker.tracker.website.plotly_figures import Figure, plotly_figure


class Drawing:
    """What `spook_tracker.engine.display` asks for."""

    def scene(self, scene: Scene) -> str:
        """The scene at its start, to be turned."""
        from spook_tracker.tracker.measure.scene_drawing import drawing
        from spook_tracker.tracker.measure.trajectory import at_rest
        from spook_tracker.tracker.website.one_replay import replay_document

        return replay_document(drawing(scene), at_rest(scene), "Scene", still=True)

    def motion(self, result: Result) -> str:
        """The run as a replay; it is run again with everything traced that is drawn."""
        from spook_tracker.tracker.measure.scene_drawing import drawing
        from spook_tracker.tracker.measure.trajectory import motion
        from spook_tracker.tracker.website.one_replay import replay_document

        of = result.origin
        if of is None:
            raise EngineError(
                "show: only what simulate() gave can be run again; trace what you want to see, and plot it"
            )
        found = motion(of.scene, of.method, result.time_step, result.steps, of.simulate)
        if found is None:
            raise EngineError("show: the run has no second sample to show")
        return replay_document(drawing(of.scene), found, "Run")

    def traces(self, result: Result, names: tuple[str, ...]) -> Figure:
        """These traces over time, a line per component."""
        lines: list[Line] = []
        for name in names:
            values, times = result.partial[name], tuple(map(float, result.sample_times[name]))
            columns = columns_of(name, values.shape[1:])
            for column, of_column in zip(columns, values.reshape(len(times), -1).T, strict=True):
                ys = tuple(map(float, of_column))
                lines.append(Line(name=column, x=times, y=ys, style="line", colour=len(lines) % 8))
        label = names[0] if len(names) == 1 else "value"
        return plotly_figure(
            Chart(name="traces", title="", x_label="time [s]", y_label=label, lines=tuple(lines))
        )


DISPLAY = Drawing()


class _OfTest(History):
    """A history of which only the series of one test are read."""

    def __init__(self, whole: History, test: str) -> None:
        vars(self).update(vars(whole))
        self._test = test

    def series(self, keys: Iterable[str] | None = None, *, evidence: bool = True) -> dict[str, SeriesHistory]:
        own = [
            key for key in (self.series_keys() if keys is None else keys) if key.startswith(f"{self._test}/")
        ]
        return super().series(own, evidence=evidence)


def trend_figure(history: History, test: str, metric: str = "") -> Figure:
    """A test's value over versions, as on its page: of its first gate, or of `metric`. UnknownName if there is none."""
    chapter, found = _in(history, book(_OfTest(history, test)).engines, test)
    named: Mapping[str, Trend] = {t.definition.metric: t for t in reversed(found.trends)}
    if metric and metric not in named:
        raise UnknownName(f"{test} has no metric {metric!r}; {nearest(metric, sorted(named))}")
    gates = found.gates() or found.trends
    return plotly_figure(trend_chart(named[metric] if metric else gates[0], chapter.nights, each="version"))


def ladder_figure(history: History, test: str) -> Figure:
    """A test's error against run time, all configurations and engines, as on its page. UnknownName without a ladder."""
    whole = book(_OfTest(history, test))
    chapter, found = _in(history, whole.engines, test)
    peers = whole.peers(test) if chapter is whole else ()
    charts = ladder_charts(found, peers=peers, earlier=chapter.earlier)
    if not charts:
        raise UnknownName(
            f"no error against run time is recorded of {test}; measure it with: tracker run {test} --sweep"
        )
    return plotly_figure(charts[0])


def _in(history: History, engines: Iterable[Chapter], test: str) -> tuple[Chapter, TestHistory]:
    """The first engine that has answered the test."""
    for chapter in engines:
        for found in chapter.tests:
            if found.name == test and found.trends:
                return chapter, found
    raise unknown_test(history.series_keys(), test)
