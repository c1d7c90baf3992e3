"""A CI service small enough to read: runs a GitHub workflow's own steps against a repository on this machine.

Shell steps run as they stand. Of the actions that the workflows here use, what each does to the folder one works
in is done instead; anything else is an error, so that a new step cannot be passed over.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

EXPRESSION = re.compile(r"\$\{\{(.*?)\}\}")
NOTHING_HERE = (
    "actions/setup-python",
    "actions/cache",
    "actions/upload-pages-artifact",
    "actions/deploy-pages",
)


@dataclass
class Ran:
    """What a job came to."""

    result: str = "success"  # failure, skipped
    outputs: dict[str, str] = field(default_factory=dict)
    log: str = ""
    summary: str = ""
    workspace: Path = Path()


@dataclass
class Service:
    """Runs workflows for one repository; `programs` comes first in PATH."""

    origin: Path
    folder: Path
    programs: Path
    artifacts: dict[str, list[Path]] = field(default_factory=dict)
    runs: int = 0

    def run(
        self, workflow: Path, event: str, branch: str, ended: dict[str, Ran] | None = None, **inputs: str
    ) -> dict[str, Ran]:
        """Every job of a reusable workflow for an event on a branch; those that have `ended` are not run again."""
        said = yaml.safe_load(workflow.read_text(encoding="utf-8"))
        declared = said[True]["workflow_call"]["inputs"]  # YAML 1.1 reads the key `on` as true
        given = {name: str(what.get("default", "")) for name, what in declared.items()} | inputs
        self.runs += 1
        if not ended:
            self.artifacts.clear()
        jobs = dict(ended or {})
        for name, job in said["jobs"].items():
            if name in jobs:
                continue
            context = {"inputs": given, "github": self._github(event), "needs": jobs, "branch": branch}
            jobs[name] = self._job(name, job, context)
        return jobs

    def act(
        self, action: Path, event: str, branch: str, before: str, history: Path | None = None, **inputs: str
    ) -> Ran:
        """A composite action's steps, in a checkout where `before` has run and `history` lies in history/."""
        said = yaml.safe_load(action.read_text(encoding="utf-8"))
        assert said["runs"]["using"] == "composite"
        given = {name: str(what.get("default", "")) for name, what in said["inputs"].items()} | inputs
        assert set(given) == set(said["inputs"])
        self.runs += 1
        context: dict[str, Any] = {
            "inputs": given,
            "github": self._github(event),
            "branch": branch,
            "steps": {},
        }
        ran = Ran(workspace=self.folder / f"{self.runs}-action")
        assert self._checkout({"fetch-depth": "0"}, ran.workspace, context)
        if history is not None:
            shutil.copytree(history, ran.workspace / "history")
        for step in ({"shell": "bash", "run": before}, *said["runs"]["steps"]):
            assert step["shell"] == "bash", "a composite action has to say so"
            if not self._shell(step, ran.workspace, context, ran):
                ran.result = "failure"
                break
        return ran

    def _github(self, event: str) -> dict[str, Any]:
        return {"event_name": event, "token": "token", "run_id": str(self.runs), "event": {"number": "7"}}

    def _job(self, name: str, job: dict[str, Any], context: dict[str, Any]) -> Ran:
        ran = Ran()
        needs = job.get("needs", [])
        done = [context["needs"][need].result for need in ([needs] if isinstance(needs, str) else needs)]
        condition = str(job.get("if", "true"))
        if ("always()" not in condition and set(done) - {"success"}) or not _holds(condition, context):
            ran.result = "skipped"
            return ran
        workspace = self.folder / f"{self.runs}-{name}"
        workspace.mkdir(parents=True)
        context["steps"] = {}
        for step in job["steps"]:
            worked = self._step(step, workspace, context, ran)
            if not worked and not step.get("continue-on-error"):
                ran.result = "failure"
                break
        ran.outputs = {key: _filled(text, context) for key, text in job.get("outputs", {}).items()}
        return ran

    def _step(self, step: dict[str, Any], workspace: Path, context: dict[str, Any], ran: Ran) -> bool:
        if "uses" not in step:
            return self._shell(step, workspace, context, ran)
        given = {key: _filled(str(text), context) for key, text in step.get("with", {}).items()}
        action = step["uses"].partition("@")[0]
        if action == "actions/checkout":
            return self._checkout(given, workspace, context)
        if action == "actions/upload-artifact":
            self.artifacts[given["name"]] = sorted(workspace.glob(given["path"]))
            return bool(self.artifacts[given["name"]])
        if action == "actions/download-artifact":
            (workspace / given["path"]).mkdir()
            for path in self.artifacts[given["name"]]:
                shutil.copy(path, workspace / given["path"])
            return True
        assert action in NOTHING_HERE, f"nothing is known here of {action}"
        return True

    def _checkout(self, given: dict[str, str], workspace: Path, context: dict[str, Any]) -> bool:
        ref, into = given.get("ref", context["branch"]), workspace / given.get("path", ".")
        depth = [] if given.get("fetch-depth") == "0" else ["--depth", "1"]
        command = ["git", "clone", "-q", "--branch", ref, *depth, self.origin.as_uri(), str(into)]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def _shell(self, step: dict[str, Any], workspace: Path, context: dict[str, Any], ran: Ran) -> bool:
        files = {name: self.folder / name for name in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
        for file in files.values():
            file.write_text("")
        told = {key: _filled(str(text), context) for key, text in step.get("env", {}).items()}
        environment = {
            **{k: v for k, v in os.environ.items() if not k.startswith(("TRACKER", "GITHUB", "CI", "PIP"))},
            "PATH": f"{self.programs}{os.pathsep}{os.environ['PATH']}",
            "GITHUB_ACTIONS": "true",
            "GITHUB_EVENT_NAME": context["github"]["event_name"],
            "GITHUB_SERVER_URL": self.origin.parent.as_uri(),
            "GITHUB_REPOSITORY": self.origin.name,
            **{name: str(file) for name, file in files.items()},
            **told,
        }
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", _filled(step["run"], context)],
            cwd=workspace, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        ran.log += done.stdout + done.stderr
        ran.summary += files["GITHUB_STEP_SUMMARY"].read_text(encoding="utf-8")
        lines = files["GITHUB_OUTPUT"].read_text(encoding="utf-8").splitlines()
        context["steps"][step.get("id", "")] = dict(line.split("=", 1) for line in lines)
        return done.returncode == 0


def _filled(text: str, context: dict[str, Any]) -> str:
    return EXPRESSION.sub(lambda found: str(_value(found[1].strip(), context)), text)


def _value(expression: str, context: dict[str, Any]) -> Any:
    """inputs.X, github.X, github.event.X, steps.ID.outputs.X, needs.JOB.result, needs.JOB.outputs.X."""
    first, *rest = expression.split(".")
    if first == "steps":
        return context["steps"].get(rest[0], {}).get(rest[2], "")
    if first == "needs":
        ran = context["needs"][rest[0]]
        return ran.result if rest[1] == "result" else ran.outputs.get(rest[2], "")
    found = context[first]
    for name in rest:
        found = found[name]
    return found


def _holds(condition: str, context: dict[str, Any]) -> bool:
    """Parts joined by &&, each a comparison, a value, or always()."""
    for part in condition.split("&&"):
        words = part.strip()
        if words in ("always()", "true", "True"):
            continue
        left, sign, right = (
            w.strip() for w in re.fullmatch(r"(\S+)\s*(?:(==|!=)\s*'(.*)')?", words).groups("")
        )  # type: ignore[union-attr]
        value = _value(left, context)
        if sign:
            if (value == right) != (sign == "=="):
                return False
        elif str(value).lower() != "true":
            return False
    return True
