"""The comment that a change is told in: only one of the service's own account is ever changed."""

import json
import re
import shutil
import subprocess

import pytest

from tests.places import ROOT

WORKFLOW = ROOT / ".github" / "workflows" / "track.yml"


@pytest.mark.skipif(shutil.which("jq") is None, reason="jq, which gh has inside, is not installed here")
def test_a_comment_with_our_mark_that_another_account_wrote_is_not_ours(tmp_path):
    lines = WORKFLOW.read_text(encoding="utf-8").splitlines()
    ours, told = (
        next(line.strip() for line in lines if line.strip().startswith(name)) for name in ("ours=", "told=")
    )
    mark = "<!-- tracker -->"
    comments = [
        {"id": 1, "user": {"login": "stranger"}, "body": f"{mark} all is well"},
        {"id": 2, "user": {"login": "github-actions[bot]"}, "body": "another job's words"},
        {"id": 3, "user": {"login": "github-actions[bot]"}, "body": f"{mark} slower"},
    ]
    (tmp_path / "comments.json").write_text(json.dumps(comments))
    gh = f'gh() {{ jq -r "${{@: -1}}" {tmp_path / "comments.json"}; }}'
    script = "\n".join(
        (gh, f"mark='{mark}'", "comments=any", re.sub(r"\s#.*$", "", ours), told, 'echo "$told"')
    )

    done = subprocess.run(["bash", "-euc", script], capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "3"
