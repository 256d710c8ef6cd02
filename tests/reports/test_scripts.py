"""The page's script, put together of modules: each once, behind what it imports, nothing lost, no circle."""

import re
import shutil
import subprocess
from importlib.resources import files

import pytest

from reports import scripts
from reports.html import script

ROOM = files("reports").joinpath("templates", "page")


def test_every_module_is_on_the_page_once_behind_its_imports() -> None:
    text = script(live=True)
    names = sorted(one.name.removesuffix(".js") for one in ROOM.iterdir())
    places = {name: text.index(f"const {name}$ = ") for name in names}
    assert all(text.count(f"const {name}$ = ") == 1 for name in names)
    for name in names:
        source = ROOM.joinpath(f"{name}.js").read_text(encoding="utf-8")
        assert len(source.splitlines()) <= 250
        wanted = re.findall(r'^import .* from "\./(\w+)\.js";$', source, re.MULTILINE)
        assert len(wanted) == source.count("import {"), name
        assert all(places[other] < places[name] for other in wanted), name
    assert not re.search(r"^\s*(import|export)\b", text, re.MULTILINE)


def test_modules_in_a_circle_are_refused(monkeypatch) -> None:
    texts = {"page/a.js": 'import { b } from "./b.js";\nexport const a = 1;\n',
             "page/b.js": 'import { a } from "./a.js";\nexport const b = 2;\n'}  # fmt: skip
    monkeypatch.setattr(scripts, "asset", texts.__getitem__)
    with pytest.raises(ValueError, match="a -> b -> a"):
        scripts.bundled.__wrapped__("a")


@pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")
def test_a_bundle_runs_as_its_modules_would(monkeypatch, tmp_path) -> None:
    texts = {"page/a.js": 'import { two } from "./b.js";\nconst own = 3;\nconsole.log(own * two());\n',
             "page/b.js": "const own = 2;\nexport const two = () => own;\n"}  # fmt: skip
    monkeypatch.setattr(scripts, "asset", texts.__getitem__)
    (tmp_path / "a.js").write_text(scripts.bundled.__wrapped__("a"), encoding="utf-8")
    done = subprocess.run(["node", str(tmp_path / "a.js")], capture_output=True, text=True, check=True)
    assert done.stdout == "6\n"
