"""What moves on the website, in a real browser and without a network: replay, live engine, dragging in a chart."""

import json

import numpy as np
import pytest

import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, document
from tests.places import ROOT
from tests.website.browser import PATIENCE, look, wait_for

NOISE = ("GL Driver Message", "software WebGL")  # what the browser says of drawing without a graphics card


def shifted(recorded):
    """The same motion, a quarter of a metre higher from the middle on."""
    return moved(recorded, 0.25)


def moved(recorded, up):
    """The same motion, so many metres higher from the middle on."""
    channels = []
    for channel in recorded.channels:
        if channel.name == "position":
            values = motion.values_of(channel, recorded.count).copy()
            values[recorded.count // 2 :, 2] += up
            channel = motion.channel("position", "m", values)
        channels.append(channel)
    return type(recorded)(
        **{f: getattr(recorded, f) for f in recorded.__struct_fields__} | {"channels": tuple(channels)}
    )


@pytest.fixture(scope="module")
def recorded():
    found = motion.trajectory("pendulum", CATALOGUE["pendulum"], simulate)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def site(tmp_path_factory, recorded):
    nights = []
    for n in range(3):
        night = document(n)
        fields = {f: getattr(night, f) for f in night.__struct_fields__}
        nights.append(type(night)(**fields | {"trajectories": (shifted(recorded) if n == 2 else recorded,)}))
    out = tmp_path_factory.mktemp("moving") / "public"
    publish(DocumentHistory(nights), out)
    return out


def visit(driver, site, page, **how):
    look(driver, **how)
    driver.get("about:blank")
    driver.get_log("browser")
    path, mark, state = page.partition("#")
    driver.get((site / path).as_uri() + mark + state)


def complaints(driver):
    return [e["message"] for e in driver.get_log("browser") if not any(n in e["message"] for n in NOISE)]


def replay(driver, site, state="", afresh=True):
    """The replay of a page, opened afresh; or as it is, at its start, where it is open and what was done to it does not matter."""
    there = "return !!document.getElementById('replay')?.player"
    if (
        not afresh
        and driver.current_url.startswith((site / "tests/pendulum.html").as_uri())
        and driver.execute_script(there)
    ):
        driver.execute_script("document.getElementById('replay').player.seek(0)")
        return
    visit(driver, site, f"tests/pendulum.html{state}")
    driver.execute_script("document.getElementById('replay').scrollIntoView()")
    wait_for(driver, "!!document.getElementById('replay').player")


def test_a_wide_ground_leaves_room_for_nothing_above_or_below_it(driver, site):
    """Drawn as far as its farthest corner in every direction, what stands on it would be a dot."""
    replay(driver, site, afresh=False)
    ends = driver.execute_script(
        "return extentOf({bodies: 1, count: 1, links: [], attractors: [], position: [0, 0, 0], solids: ["
        "{kind: 'facets', fixed: true, body: 0, position: [1, 0, 0.5], orientation: [1, 0, 0, 0],"
        " size: [3, 0, 0, 0, 8, 0, 0, 8, 6, 0]}]})"
    )
    assert ends == {"low": [1, 0, 0.5], "high": [9, 6, 0.5]}


def test_a_replay_shows_where_the_engine_put_the_body(driver, site, recorded):
    replay(driver, site, afresh=False)
    driver.execute_script("document.getElementById('replay').player.seek(200)")
    shown = driver.execute_script(
        "const p = document.getElementById('replay').player; return [...p.movie.position.slice(600, 603)]"
    )
    channel = next(c for c in shifted(recorded).channels if c.name == "position")

    assert shown == pytest.approx(motion.values_of(channel, recorded.count)[200].tolist(), abs=1e-6)
    assert driver.execute_script("return document.querySelector('#replay canvas').width") > 200
    assert not driver.execute_script("return document.querySelector('#replay .scenery').checkVisibility()")
    assert complaints(driver) == []


def test_a_friction_cone_stands_at_each_contact_point_and_says_whether_it_slides(driver, site, recorded):
    """Two points with mu = .5: one force leans by .2 of its normal, the other by as much as friction bears."""
    replay(driver, site)
    shown = driver.execute_script(
        "const p = document.getElementById('replay').player, n = p.movie.count;"
        "const each = (v) => Float32Array.from({length: n * v.length}, (_, i) => v[i % v.length]);"
        "p.use({...p.movie, cones: {point: each([1, 2, 0, 3, 2, 0]), axis: each([0, 0, 1, 0, 0, 1]),"
        " force: each([2, 0, 10, 5, 0, 10]), friction: each([0.5, 0.5])}});"
        "p.seek(3); const c = p.view.cones, m = c.mesh, same = (i, k) => {"
        "  const t = new THREE.Color(); t.fromArray(m.instanceColor.array, 3 * i); return t.getHex() === k.getHex(); };"
        "const of = (i) => [...m.instanceMatrix.array.slice(16 * i, 16 * i + 16)];"
        "const before = [m.count, of(0), of(1), same(0, p.view.holding), same(1, p.view.sliding)];"
        "p.tools.querySelector('[data-tool=cones] input').click();"
        "return [...before, m.count]"
    )

    count, first, second, holds, slides, hidden = shown
    assert (count, holds, slides, hidden) == (2, True, True, 0)
    for matrix, x in ((first, 1.0), (second, 3.0)):
        wide, high = matrix[0], matrix[10]
        assert wide == pytest.approx(0.5 * high)
        assert matrix[12:15] == pytest.approx([x, 2.0, high / 2])  # the apex at the point
    assert complaints(driver) == []


def test_the_time_slider_moves_by_keyboard_and_stands_in_the_address(driver, site):
    replay(driver, site)
    driver.execute_script(
        "const s = document.querySelector('#replay input[type=range]'); s.value = 60; s.dispatchEvent(new Event('input'))"
    )
    address = driver.current_url
    clock = driver.execute_script("return document.querySelector('#replay .clock').textContent")

    replay(driver, site, "#" + address.partition("#")[2])

    assert "t=2" in address
    assert (
        driver.execute_script("return document.querySelector('#replay .clock').textContent")
        == clock
        == "2.00 s"
    )


def test_the_slider_hears_real_keys(driver, site):
    from selenium.webdriver.common.keys import Keys

    replay(driver, site, afresh=False)
    slider = driver.find_element("css selector", "#replay input[type=range]")
    driver.find_element("css selector", "#replay .play").send_keys(Keys.TAB)
    assert driver.switch_to.active_element == slider
    sample = "return document.getElementById('replay').player.sample"
    reached = []
    for key in (Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT, Keys.END, Keys.HOME):
        slider.send_keys(key)
        reached.append(driver.execute_script(sample))
    first, second, back, last, start = reached

    assert 0 < first < second
    assert back == pytest.approx(first)
    assert (start, last) == (
        0,
        driver.execute_script("return document.getElementById('replay').player.movie.count - 1"),
    )
    slider.send_keys(Keys.ARROW_RIGHT)
    assert "t=" in driver.current_url
    assert slider.get_attribute("aria-valuetext").endswith("seconds")


def test_the_camera_hears_real_keys(driver, site):
    """Arrows turn about the middle of the scene, + and - change the distance, Home goes back."""
    from selenium.webdriver.common.keys import Keys

    replay(driver, site, afresh=False)
    canvas = driver.find_element("css selector", "#replay canvas")
    seen = """const v = document.getElementById('replay').player.view, d = v.camera.position.clone().sub(v.controls.target);
        return [Math.atan2(d.y, d.x), Math.asin(d.z / d.length()), d.length()]"""
    start = driver.execute_script(seen)
    told = {}
    for key in (Keys.ARROW_RIGHT, Keys.ARROW_UP, "+", "-", Keys.ARROW_DOWN, Keys.ARROW_LEFT):
        canvas.send_keys(key)
        told[key] = driver.execute_script(seen)
    ten = np.radians(10.0)

    assert told[Keys.ARROW_RIGHT] == pytest.approx([start[0] + ten, start[1], start[2]])
    assert told[Keys.ARROW_UP] == pytest.approx([start[0] + ten, start[1] + ten, start[2]])
    assert told["+"][2] == pytest.approx(start[2] / 1.15)
    assert told[Keys.ARROW_LEFT] == pytest.approx(start)
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, "-", Keys.HOME)
    assert driver.execute_script(seen) == pytest.approx(start)
    assert canvas.accessible_name.startswith("The scene in three dimensions")
    assert complaints(driver) == []


def test_bar_and_axes_of_a_replay_measure_what_the_camera_sees(driver, site):
    """Against the library's own projection, from two directions, in both themes."""
    told = []
    for dark in (False, True):
        visit(driver, site, "tests/pendulum.html", dark=dark)
        driver.execute_script("document.getElementById('replay').scrollIntoView()")
        wait_for(driver, "!!document.getElementById('replay').player")
        told += driver.execute_async_script("""
          const done = arguments[0], drawn = () => new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(then)));
          (async () => {
          const v = document.getElementById('replay').player.view, wide = v.host.clientWidth, high = v.host.clientHeight, found = [];
          for (const key of ['', 'ArrowRight', 'ArrowUp', '-']) {
            v.turnBy(key);
            await drawn();
            const m = v.camera.matrixWorld.elements, at = (p) => { const q = p.project(v.camera); return [q.x * wide / 2, q.y * high / 2]; };
            const middle = v.controls.target, start = at(middle.clone());
            const across = at(middle.clone().add({ x: m[0] * v.marks.metres, y: m[1] * v.marks.metres, z: m[2] * v.marks.metres }));
            const axes = v.marks.axes.map((axis) => axis.line.getAttribute('d').split('l')[1].split(' ').map(Number));
            found.push({ bar: across[0] - start[0], drawn: Number(v.marks.bar.getAttribute('d').split('h')[1].split('v')[0]),
              axes, near: v.size * 1e-4, words: v.marks.length.textContent, seen: getComputedStyle(v.marks.length).fill,
              ground: getComputedStyle(v.host).backgroundColor, inside: [...v.marks.svg.children].every((part) => {
                const a = part.getBoundingClientRect(), b = v.host.getBoundingClientRect();
                return a.left >= b.left && a.right <= b.right && a.top >= b.top && a.bottom <= b.bottom; }),
              projected: ['x', 'y', 'z'].map((k) => { const p = middle.clone(); p[k] += v.size * 1e-4; const q = at(p); return [q[0] - start[0], q[1] - start[1]]; }) });
          }
          return found;
          })().then(done);
        """)

    for seen in told:
        assert seen["drawn"] == pytest.approx(seen["bar"], abs=0.1)
        assert seen["words"] in ("0.1 m", "0.2 m", "0.5 m", "1 m")
        assert seen["inside"]
        for drawn, projected in zip(seen["axes"], seen["projected"], strict=True):
            assert drawn[0] * -projected[1] == pytest.approx(drawn[1] * projected[0], abs=0.02)
            assert drawn[0] * projected[0] >= -1e-9
    assert told[0]["seen"] != told[-1]["seen"]


def test_who_wants_little_motion_gets_none_that_was_not_asked_for(driver, site):
    """Nothing plays by itself, nothing glides, nothing fades: what moves is what the reader moves."""
    moved = """return [getComputedStyle(document.documentElement).scrollBehavior, document.getAnimations().length,
        [...document.querySelectorAll('*')].filter((e) => parseFloat(getComputedStyle(e).transitionDuration) > 0).length]"""
    still = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    replay(driver, site)
    assert driver.execute_script(moved)[0] == "smooth"
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": still})
    replayed = driver.execute_script("return document.getElementById('replay').player.playing")
    driver.execute_script("document.getElementById('f-deviation-against-time').scrollIntoView()")
    wait_for(driver, "'drawn' in document.getElementById('f-deviation-against-time').dataset")

    assert driver.execute_script(moved) == ["auto", 0, 0]
    assert not replayed
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_two_nights_lie_over_each_other_or_side_by_side_seen_from_one_place(driver, site, recorded):
    """Laid over each other they show the first moment they part."""
    replay(driver, site)
    driver.execute_script(
        "const s = document.querySelector('#replay label select'); s.selectedIndex = 1; s.dispatchEvent(new Event('change'))"
    )
    wait_for(driver, "!!document.querySelector('#replay button[data-sample]')")
    driver.execute_script("document.querySelector('#replay button[data-sample]').click()")
    sample = driver.execute_script("return document.getElementById('replay').player.sample")

    assert sample == recorded.count // 2
    assert "against=" in driver.current_url
    box = "[...document.querySelectorAll('#replay label')].find((l) => l.textContent.includes('side by side')).querySelector('input')"
    driver.execute_script(f"{box}.click()")
    wait_for(driver, "document.querySelectorAll('#replay canvas').length === 2")
    told = driver.execute_script("""
      const p = document.getElementById('replay').player;
      p.seek(200);
      p.view.camera.position.set(9, 8, 7);
      p.view.controls.update();
      p.view.controls.dispatchEvent({ type: 'change' });
      const at = (view) => { view.poses.at(0, 200); return [...view.poses.p]; };
      return [at(p.view), at(p.second), p.second.camera.position.toArray(), p.second.sample];
    """)

    assert told[0][2] - told[1][2] == pytest.approx(0.25, abs=1e-4)  # tonight is wrong by that much
    assert told[2] == pytest.approx([9, 8, 7], abs=1e-6)
    assert told[3] == 200
    assert "beside=1" in driver.current_url
    driver.execute_script(f"{box}.click()")
    assert driver.execute_script("return document.querySelectorAll('#replay canvas').length") == 1
    assert complaints(driver) == []


def test_without_a_script_the_picture_stands_still(site):
    page = (site / "tests" / "pendulum.html").read_text()

    assert 'class="scenery"' in page
    assert "three-scene" in page and '<script src="../assets/three-scene' not in page


def test_dragging_zooms_into_a_chart_and_writes_the_address(driver, site):
    visit(driver, site, "tests/pendulum.html", height=1200)
    box = "document.getElementById('f-deviation-against-time')"
    driver.execute_script(f"{box}.scrollIntoView({{block: 'center'}})")
    wait_for(driver, f"'drawn' in {box}.dataset")
    # Charts above are drawn as they come near, and move this one.
    wait_for(
        driver,
        f"(() => {{const top = {box}.querySelector('.nsewdrag').getBoundingClientRect().top, stood = window.stood === top;"
        " window.still = stood ? (window.still || 0) + 1 : 0; window.stood = top; return window.still >= 3})()",
    )
    where = driver.execute_script(
        f"const r = {box}.querySelector('.nsewdrag').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]"
    )
    ranges = f"return {box}.querySelector('.plot').layout.xaxis.range"
    before = driver.execute_script(ranges)
    left, top, wide, high = where
    for kind, x, y in (
        ("mousePressed", 0.3, 0.3),
        ("mouseMoved", 0.5, 0.5),
        ("mouseMoved", 0.6, 0.7),
        ("mouseReleased", 0.6, 0.7),
    ):
        event = {
            "type": kind,
            "x": left + x * wide,
            "y": top + y * high,
            "button": "left",
            "clickCount": 1,
            "buttons": 1,
        }
        driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)
    wait_for(driver, "location.hash.includes('z.f-deviation-against-time')")
    after = driver.execute_script(ranges)

    span = before[1] - before[0]
    assert after[0] == pytest.approx(before[0] + 0.3 * span, abs=0.03 * span)
    assert after[1] == pytest.approx(before[0] + 0.6 * span, abs=0.03 * span)
    assert complaints(driver) == []


@pytest.mark.skipif(not (ROOT / "site" / "static" / "live.wasm").exists(), reason="not built: make wasm")
def test_a_slider_of_the_live_page_runs_the_engine_again(driver, site):
    visit(driver, site, "live.html#scene=pendulum&p.method=curved", width=360)
    wait_for(driver, "!!document.querySelector('.live').page")
    fact = "return document.querySelector('[data-fact=\"{}\"]').textContent"
    first = driver.execute_script(fact.format("final state"))
    driver.execute_script(
        "const s = document.getElementById('live-angle'); s.value = 120; s.dispatchEvent(new Event('input'))"
    )
    wait_for(
        driver, f"document.querySelector('[data-fact=\"final state\"]').textContent !== {json.dumps(first)}"
    )

    assert driver.execute_script(fact.format("outcome")) == "completed"
    assert "p.angle=120" in driver.current_url and "p.method=curved" in driver.current_url
    assert driver.execute_script("return document.documentElement.scrollWidth") <= 360
    assert complaints(driver) == []


LIVE = ("pendulum", "chain", "edge", "slope", "oscillator", "planetarium", "beam", "pile")
FACT = "return document.querySelector('[data-fact=\"{}\"]').textContent"


@pytest.mark.skipif(not (ROOT / "site" / "static" / "live.wasm").exists(), reason="not built: make wasm")
@pytest.mark.parametrize("scene", LIVE)
def test_a_live_scene_opens_runs_and_a_link_restores_what_a_slider_says(driver, site, scene):
    """By the keyboard: one press on its last slider is one step of it, in the address and in the run."""
    from selenium.webdriver.common.keys import Keys

    if driver.current_url.startswith((site / "live.html").as_uri()):  # with another scene
        driver.execute_script("location.hash = arguments[0]", f"#scene={scene}")
    else:
        visit(driver, site, f"live.html#scene={scene}")
    there = "(page) => page && page.name === arguments[0] && !page.other"  # and its answer is shown
    wait_for(driver, f"({there})(document.querySelector('.live').page)", scene)
    assert driver.execute_script("return Object.keys(LIVE_SCENES)") == list(LIVE)
    # The chain at the edge opens without damping, and explodes: rods of 1 m end 317 m too long.
    expected = "unsettled" if scene == "edge" else "completed"
    assert driver.execute_script(FACT.format("outcome")) == expected
    first = driver.execute_script(FACT.format("final state"))
    slider = driver.find_elements("css selector", ".live-form input[type=range]")[-1]
    name = slider.get_attribute("id").removeprefix("live-")
    _, high, step, value = (float(slider.get_attribute(key)) for key in ("min", "max", "step", "value"))
    key = Keys.ARROW_RIGHT if value + step <= high else Keys.ARROW_LEFT
    slider.send_keys(key)
    state = "document.querySelector('[data-fact=\"final state\"]').textContent"
    wait_for(driver, f"{state} !== {json.dumps(first)}")
    second, address = driver.execute_script(f"return {state}"), driver.current_url
    moved = value + (step if key == Keys.ARROW_RIGHT else -step)

    query = dict(part.split("=") for part in address.partition("#")[2].split("&"))
    assert query["scene"] == scene
    assert float(query[f"p.{name}"]) == pytest.approx(moved)
    if scene in ("pendulum", "beam"):
        driver.get("about:blank")
        driver.get(address)
    wait_for(driver, "!!document.querySelector('.live').page")
    assert driver.execute_script("return document.getElementById('live-scene').value") == scene
    assert float(
        driver.execute_script(f"return document.getElementById('live-{name}').value")
    ) == pytest.approx(moved)
    assert driver.execute_script(f"return {state}") == second
    player = "document.querySelector('.live figure').querySelector('canvas')"
    assert driver.execute_script(
        f"return {player}.width > 100 && document.querySelector('.live').page.player.movie.count > 10"
    )
    assert complaints(driver) == []


BUILT = pytest.mark.skipif(
    not (ROOT / "site" / "static" / "live.wasm").exists(), reason="not built: make wasm"
)


@BUILT
def test_pictures_go_on_while_the_engine_computes_and_the_newest_question_is_answered(driver, site):
    """A pile that takes far longer than a picture: its computing is in a worker."""
    visit(driver, site, "live.html#scene=pile")
    wait_for(driver, "!!document.querySelector('.live').page")
    driver.set_script_timeout(PATIENCE)
    gap, milliseconds, first, last = driver.execute_async_script("""
      const done = arguments[arguments.length - 1], page = document.querySelector('.live').page;
      const fact = (name) => document.querySelector(`[data-fact="${name}"]`).textContent, first = fact('steps');
      const rate = document.getElementById('live-rate');
      for (const value of ['240', '300', '480']) { rate.value = value; rate.dispatchEvent(new Event('input')); }
      let longest = 0, before = performance.now();
      const from = before;
      const look = (now) => {
        if (fact('steps').startsWith('1920 of')) { done([longest, before - from, first, fact('steps')]); return; }
        longest = Math.max(longest, now - before);
        before = now;
        requestAnimationFrame(look);
      };
      requestAnimationFrame(look);
    """)

    assert first.startswith("240 of") and last.startswith("1920 of")
    assert gap < 0.5 * milliseconds, f"the longest picture took {gap} ms of {milliseconds}"


@BUILT
def test_without_webgl_the_live_page_has_numbers_and_curves(driver, site):
    source = "HTMLCanvasElement.prototype.getContext = () => null;"
    planted = driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
    try:
        visit(driver, site, "live.html#scene=oscillator")
        wait_for(driver, "!!document.querySelector('.live').page")
        told = driver.execute_script("return document.querySelector('.live').innerText")
        curves = driver.execute_script("return document.querySelectorAll('.curve path.line').length")
    finally:
        driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", planted)

    assert "no WebGL" in told and "completed" in told
    assert "largest extension" in told and "violation" not in told
    assert curves >= 2


@BUILT
@pytest.mark.parametrize(("angle", "ratio"), [(20, 0.36397), (35, 0.5)], ids=["stands", "slides"])
def test_the_box_on_a_slope_shows_friction_over_normal_force_while_it_runs(driver, site, angle, ratio):
    """tan 20° while it stands, mu = .5 where it slides (tan 35° = .7): in the list, and as a curve with the clock."""
    visit(driver, site, f"live.html#scene=slope&p.angle={angle}")
    wait_for(driver, "!!document.querySelector('.live').page")
    told = driver.execute_script(FACT.format("friction / normal force"))
    curve = driver.execute_script("""
      const p = document.querySelector('.live').page.player;
      p.seek(60);
      const box = [...document.querySelectorAll('.curve')].find((c) => c.textContent.includes('friction / normal'));
      const heights = (path) => path.getAttribute('d').split(/[ML]/).slice(3).map((p) => Number(p.split(' ')[1]));
      const [now] = [...box.querySelectorAll('path.line')].map(heights);
      return [box.querySelectorAll('path.line').length, box.querySelector('.value').textContent, Math.max(...now) - Math.min(...now)];
    """)

    assert float(told.split()[0]) == pytest.approx(ratio, abs=1e-4)
    assert "µ = 0.5" in told
    lines, value, wobble = curve
    assert lines == 2
    assert wobble < 0.2, "rounding is not drawn as if it were motion"
    assert [float(v) for v in value.split(" · ")] == pytest.approx([ratio, 0.5], abs=1e-4)


def test_ten_thousand_bodies_are_drawn_in_one_picture(driver, site):
    """Instanced: three.js is asked for one draw call a shape. (How long it takes is a matter of `make bench`.)"""
    replay(driver, site)
    calls = driver.execute_async_script("""
      const n = 10000, box = document.getElementById('replay'), position = new Float32Array(2 * 3 * n);
      for (let i = 0; i < 2 * n; i += 1) { position.set([i % 100, Math.floor(i / 100) % 100, (i % 7)], 3 * i); }
      const solids = Array.from({ length: n }, (_, body) => ({ kind: body % 2 ? 'box' : 'sphere', size: body % 2 ? [1, 1, 1] : [0.5],
        position: [...position.slice(3 * body, 3 * body + 3)], orientation: [1, 0, 0, 0], fixed: false, body }));
      box.player.use({ step: 1, count: 2, bodies: n, solids, links: [], rows: 0, gravity: [0, 0, -1], attractors: [], position, orientation: null });
      box.player.seek(0.5);
      const { render } = box.player.view.renderer.info, done = arguments[0];
      requestAnimationFrame(() => requestAnimationFrame(() => done([render.calls, render.triangles])));
    """)

    assert calls[0] <= 4
    assert calls[1] > 10_000 * 12 / 2
    assert np.isfinite(calls[1])
