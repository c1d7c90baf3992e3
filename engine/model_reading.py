"""What can be said of a model file without any engine: its files, their hash, its bodies, its time step.

Only XML is read, and with care, for the file may come from anywhere: no entities, bounded size, depth, copies and number
of files, and nothing outside the folder the model belongs to. Includes, attached models, meshes, height fields and
textures are followed; together they are the model, and their hash is its definition.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from .model_bodies import (
    DEEPEST,
    Body,
    ModelError,
    drives,
    hang_mjcf,
    hang_sdf,
    hanging,
    moving,
    product_of,
    urdf_bodies,
)
from .model_file import Format, Watched
from .model_masses import wrong_mass
from .model_meshes import ENTITIES, harm_in
from .model_parts import attach, settle_joint_types

MOST_BYTES = 64_000_000  # of one file; the largest mesh of the robots people share has a third of that
MOST_XML = 16_000_000  # bytes of a file that is read as text: elements take ten times their text in memory
MOST_FILES = 3_000
MOST_COPIES = 10_000  # that one element makes: engines write out each of them before they look at the next
MOST_ROOM = 100_000_000  # numbers that one element asks for without a file that holds them
ROOM = {
    "hfield": ("nrow", "ncol"),
    "texture": ("width", "height"),
    "user": ("dim",),
}  # whose product is that
KEPT = ("nkey", "nuser")  # of <size>, as these begin: rows of numbers
ROW = 100  # numbers in one, at least
MOST_ITERATIONS = 100_000  # of a solver in a step, which is not looked into
SHORTEST = 1e-6  # s, of a time step: with less a second takes hours
COPYING = ("replicate", "composite", "flexcomp")  # elements with a count, or a product of counts
MOST_ELEMENTS = 1_000_000  # of a model with all copies
XACRO = ("{http://www.ros.org/wiki/xacro}", "{http://ros.org/wiki/xacro}")
IN_PACKAGES = ("package://", "model://")
POINTER = b"version https://git-lfs"  # what a clone without Git LFS has in place of a file
MOST_WATCHED = 8
TIME_STEP = 0.002  # s, of MJCF that names none; also what MuJoCo gives a URDF
GRAVITY = (0.0, 0.0, -9.81)  # m/s², of a file that names none
STRONGEST = 1e9  # m/s²
ROOTS = (".git", "tracker.toml", "pyproject.toml", "package.xml")  # whose folder is a whole
INSTALLED = ("site-packages", "dist-packages")  # whose folders are wholes
FILES_OF = {  # element: attributes that name files
    "mesh": ("file", "filename"),
    "hfield": ("file",),
    "skin": ("file",),
    "flexcomp": ("file",),
    "texture": ("file", "filename", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"),
}
NAMING_SDF = ("include", "mesh", "heightmap", "image")  # whose <uri> is read; a material's script is not


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What a model consists of."""

    path: Path
    format: Format
    files: tuple[Path, ...]  # itself first
    digest: str
    time_step: float  # s
    watched: tuple[Watched, ...]  # free bodies and the ends of its chains
    keyframes: tuple[str, ...] = ()
    bodies: int = 0  # that move
    stands_free: bool = False  # everything that moves is free: nothing but contacts carries it
    driven: bool = False  # it has actuators
    gravity: tuple[float, float, float] = GRAVITY  # m/s²
    assets: dict[str, Path] = field(default_factory=dict)  # a URDF's meshes, as it names them


def folder_of(path: Path) -> Path:
    """The folder a model belongs to: its repository, installed package or ROS package; else the one it lies in."""
    here = _resolved(path).parent
    for folder in (here, *here.parents):
        if folder.parent.name in INSTALLED or any((folder / name).exists() for name in ROOTS):
            return folder
    return here


def shown(path: Path) -> str:
    """Where in its folder a model lies, for readers elsewhere: what lies above says something of a machine alone."""
    found = _resolved(path)
    folder = folder_of(path)
    above = folder.parent if folder.parent.name in INSTALLED else folder
    return found.relative_to(above).as_posix()


def read(path: Path, folder: Path | None = None) -> Reading:
    """The model in the file `path`; nothing outside `folder` (by default `folder_of` it) is touched. ModelError."""
    return _Reader(path, (folder or folder_of(path)).resolve()).reading()


class _Reader:
    """The files of one model, as they are found."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.path, self.folder = path, folder
        self.files: dict[Path, None] = {}
        self.parsed_files: dict[Path, None] = {}
        self.attached: dict[Path, ElementTree.Element | None] = {}  # none while it is read
        self.spliced = 0  # elements that came from other files

    def reading(self) -> Reading:
        root = self.parsed(self.path)
        if root.tag == "robot":
            return self.urdf(root)
        if root.tag == "sdf":
            return self.sdf(root)
        if root.tag == "mujoco":
            return self.mjcf(root)
        raise ModelError(
            f"{self.path} is no model by itself: it begins with <{root.tag}>; a model begins with <mujoco>, <robot> or <sdf>"
        )

    def inside(self, path: Path, named_in: Path | str) -> Path:
        """The file itself, if it lies inside the folder."""
        found = _resolved(path)
        if not found.is_relative_to(self.folder):
            raise ModelError(
                f'{named_in} names {path}, which lies outside {self.folder}; say folder = "…" in its [[model]] '
                "if it belongs to the model"
            )
        return found

    def taken(self, path: Path, named_in: Path | str, most: int = MOST_BYTES) -> Path:
        """A file of the model, whose size is bounded."""
        found = self.inside(path, named_in)
        if not found.is_file():
            raise ModelError(
                f"{path} is no file" if path == named_in else f"{named_in} names {path}, which is no file"
            )
        if (size := found.stat().st_size) > most:
            raise ModelError(
                f"{path} has {size / 1e6:.0f} MB; a file of a model may have {most / 1e6:.0f} MB"
            )
        with found.open("rb") as start:
            if start.read(len(POINTER)) == POINTER:
                raise ModelError(
                    f"{path} is a pointer of Git LFS in place of the file itself; fetch it with: git lfs pull"
                )
        if found not in self.files and (wrong := harm_in(found)):
            raise ModelError(f"{path} {wrong}")
        self.files.setdefault(found)
        if len(self.files) > MOST_FILES:
            raise ModelError(f"{self.path} consists of more than {MOST_FILES} files")
        return found

    def parsed(self, path: Path, named_in: Path | None = None) -> ElementTree.Element:
        """The XML of one file of the model."""
        content = self.taken(path, named_in or path, MOST_XML).read_bytes()
        self.parsed_files.setdefault(path)
        try:  # whatever it declares: engines take bytes for UTF-8
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text:  # a parser would take them for UTF-16, in which nothing below is found
            raise ModelError(f"{path} is no text in UTF-8, which engines read; save it in that encoding")
        if "<!ENTITY" in text:
            raise ModelError(f"{path} {ENTITIES}")
        try:
            root = ElementTree.fromstring(text)
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            raise ModelError(f"{path} is no XML: {error}") from None
        if any(element.tag.startswith(XACRO) for element in root.iter()):
            raise ModelError(
                f"{path} is a xacro, of which a model is made first: xacro {path.name} > expanded.urdf"
            )
        self.bounded(root, path)
        if wrong := wrong_mass(root):
            place = re.search(wrong[0], text)
            line = f", line {text.count(chr(10), 0, place.end()) + 1}," if place else ""
            raise ModelError(f"{path}{line} gives {wrong[1]}")
        return root

    def bounded(self, root: ElementTree.Element, path: Path) -> None:
        """ModelError where engines would write out more than they can."""
        level, depth, made = [(root, 1.0)], 0, 0.0
        while level:
            below: list[tuple[ElementTree.Element, float]] = []
            for one, copies in level:
                own = copies * _copies(one) if one.tag in COPYING else copies
                if own > MOST_COPIES:
                    raise ModelError(f"{path}: <{one.tag}> makes {own:.3g} copies; it may make {MOST_COPIES}")
                for name in one.attrib if one.tag == "option" else ():
                    if (
                        name.endswith(("iterations", "initpoints"))
                        and product_of(one.get(name, "")) > MOST_ITERATIONS
                    ):
                        raise ModelError(
                            f"{path}: <option> asks for {one.get(name)} {name} in a step; it may ask for {MOST_ITERATIONS}"
                        )
                if (room := _room(one)) > MOST_ROOM:
                    raise ModelError(
                        f"{path}: <{one.tag}> asks for {room:.3g} numbers; it may ask for {MOST_ROOM:.0e}"
                    )
                below += [(child, own) for child in one]
                made += own
            level, depth = below, depth + 1
            if depth > DEEPEST:
                raise ModelError(f"{path} has elements nested deeper than {DEEPEST}")
        if made > MOST_ELEMENTS:
            raise ModelError(
                f"{path} has {made:.3g} elements with all copies; it may have {MOST_ELEMENTS:.0e}"
            )

    def counted(self, element: ElementTree.Element) -> None:
        """That is put in the place of its name: each may name another twice."""
        self.spliced += sum(1 for _ in element.iter())
        if self.spliced > MOST_ELEMENTS:
            raise ModelError(
                f"{self.path} includes or attaches more than {MOST_ELEMENTS:.0e} elements in all"
            )

    def first(self, name: str, places: list[Path], file: Path, said: str = "") -> Path:
        """A file named in another, where it is `said`, looked for in several folders; the first place is the one that is
        named if it is nowhere."""
        written = Path(name.removeprefix("file://").replace("\\", "/"))
        candidates = [written] if written.is_absolute() else [place / written for place in places]
        if not any(_resolved(candidate).is_relative_to(self.folder) for candidate in candidates):
            self.inside(candidates[0], _where(said or name, file, *self.parsed_files))
        inside = [c for c in candidates if c.resolve().is_relative_to(self.folder)]
        there = next((candidate for candidate in inside if candidate.is_file()), (inside or candidates)[0])
        return self.taken(there, file if there.is_file() else _where(said or name, file, *self.parsed_files))

    # MJCF

    def mjcf(self, root: ElementTree.Element) -> Reading:
        self.completed(root, self.path)
        self.bounded(root, self.path)
        bodies = Body("")
        for world in root.findall("worldbody"):
            hang_mjcf(world, bodies)
        steps = [o.get("timestep") for o in root.findall("option") if o.get("timestep")]
        keys = [key for frames in root.findall("keyframe") for key in frames.findall("key")]
        return self.found(
            "MJCF",
            bodies,
            _step(steps[-1], self.path) if steps else TIME_STEP,
            keyframes=tuple(key.get("name") or str(place) for place, key in enumerate(keys)),
            driven=any(len(actuators) for actuators in root.findall("actuator")),
            gravity=_gravity([o.get("gravity") for o in root.findall("option")], self.path),
        )

    def completed(self, root: ElementTree.Element, file: Path) -> None:
        """With what it includes and attaches in its place, and all its files known."""
        self.expand(root, file.parent, file, (_resolved(file),))
        if not any(len(world) for world in root.findall("worldbody")):
            raise ModelError(
                f"{file} is no model by itself: nothing is in its world; it is a part for inclusion"
            )
        models = self.mjcf_files(root, file.parent, file)
        settle_joint_types(root)
        attach(root, models, self.counted)

    def expand(self, element: ElementTree.Element, main: Path, file: Path, within: tuple[Path, ...]) -> None:
        """Put what is included in its place."""
        place = 0
        while place < len(element):
            child = element[place]
            if child.tag != "include":
                self.expand(child, main, file, within)
                place += 1
                continue
            name = child.get("file")
            if not name:
                raise ModelError(f"{file} includes a file it does not name")
            found = self.first(name, [main, file.parent], file)
            if found in within:
                raise ModelError(f"{file} includes {found.name}, which includes it")
            included = self.parsed(found, file)
            self.expand(included, main, found, (*within, found))
            self.counted(included)
            element[place : place + 1] = list(included)
            place += len(included)

    def mjcf_files(self, root: ElementTree.Element, main: Path, file: Path) -> dict[str, ElementTree.Element]:
        """Meshes, height fields, skins and textures; and attached models, by name."""
        folders, models = {"mesh": "", "texture": ""}, {}
        for compiler in root.findall("compiler"):
            both = compiler.get("assetdir")
            folders["mesh"] = compiler.get("meshdir", both or folders["mesh"])
            folders["texture"] = compiler.get("texturedir", both or folders["texture"])
        for element in root.iter():
            if element.tag == "model" and (name := element.get("file")):
                child = self.first(name, [main, file.parent], file)
                if child not in self.attached:
                    self.attached[child] = None
                    other = self.parsed(child, file)
                    if other.tag == "mujoco":
                        self.completed(other, child)
                    self.attached[child] = other
                if (made := self.attached[child]) is None:
                    raise ModelError(f"{_where(name, file)} attaches {child.name}, which attaches it")
                models[element.get("name", made.get("model", ""))] = made
            for attribute in FILES_OF.get(element.tag, ()):
                if name := element.get(attribute):
                    folder = folders["texture" if element.tag == "texture" else "mesh"]
                    self.first(name, [main / folder, main], file)
        return models

    # URDF and SDF

    def urdf(self, root: ElementTree.Element) -> Reading:
        bodies = urdf_bodies(root, self.path)
        assets = {}
        compiler = root.find("mujoco/compiler")
        told = compiler.get("meshdir", compiler.get("assetdir")) if compiler is not None else None
        for mesh in root.iter("mesh"):
            if name := mesh.get("filename"):
                local, places = _local(name), self.ros_places(name)
                if told is not None:
                    beside = self.path.parent / told
                    places = [beside, *places]
                    if (beside / Path(local).name).is_file() and not (beside / local).is_file():
                        local = Path(local).name  # MuJoCo strips the folders
                assets[name] = self.first(local, places, self.path, name)
        return self.found("URDF", bodies, TIME_STEP, assets=assets)

    def ros_places(self, name: str) -> list[Path]:
        """Where a mesh may lie: beside the file, or in any folder above that the package could be."""
        above = [f for f in self.path.resolve().parents if f.is_relative_to(self.folder)]
        package = name.partition("://")[2].partition("/")[0] if name.startswith(IN_PACKAGES) else ""
        named = [f for f in above if f.name == package] + [folder / package for folder in above]
        return [*(named if package else []), self.path.parent]

    def sdf(self, root: ElementTree.Element) -> Reading:
        bodies = Body("")
        self.sdf_completed(root, self.path, (self.path.resolve(),))
        hang_sdf(root, bodies)
        if not bodies.children:
            raise ModelError(f"{self.path} is no model: it has no links")
        hanging(bodies, self.path)
        step = root.findtext(".//physics/max_step_size")
        gravity = _gravity([root.findtext(".//world/gravity")], self.path)
        return self.found("SDF", bodies, _step(step, self.path) if step else 0.001, gravity=gravity)

    def sdf_completed(self, root: ElementTree.Element, file: Path, within: tuple[Path, ...]) -> None:
        """All files that it names are looked for, and what it includes is put in its place."""
        for holder in list(root.iter()):
            for place, element in enumerate(holder):
                for uri in element.findall("uri") if element.tag in NAMING_SDF else ():
                    found = self.of_uri((uri.text or "").strip(), file)
                    if element.tag != "include":
                        continue
                    if found in within:
                        raise ModelError(f"{file} includes {found.name}, which includes it")
                    other = self.parsed(found, file)
                    self.sdf_completed(other, found, (*within, found))
                    self.counted(other)
                    if (model := other.find("model")) is not None:
                        model.set("name", element.findtext("name", model.get("name", "")).strip())
                        if (static := element.find("static")) is not None:
                            model.insert(0, static)
                        holder[place] = model

    def of_uri(self, uri: str, file: Path) -> Path:
        """The file that an SDF means: beside it, beside its folder, or in a folder above of the name it begins with; of a
        folder, its model.sdf."""
        name = uri.partition("://")[2] if uri.startswith(IN_PACKAGES) else uri
        first = name.partition("/")[0]
        above = [folder.parent for folder in file.resolve().parents if folder.name == first]
        places = [file.parent, file.parent.parent, *above]
        if any((place / name / "model.sdf").is_file() for place in places):
            name = f"{name}/model.sdf"
        return self.first(name, places, file, uri)

    def found(
        self,
        format: Format,
        bodies: Body,
        time_step: float,
        keyframes: tuple[str, ...] = (),
        assets: dict[str, Path] | None = None,
        driven: bool = False,
        gravity: tuple[float, float, float] = GRAVITY,
    ) -> Reading:
        every = list(moving(bodies, "", (), False))
        if not every:
            raise ModelError(f"nothing in {self.path} moves: it has no joints; it is a part of other models")
        tops = [body for _, body, top in every if top]
        return Reading(
            path=self.path,
            format=format,
            files=tuple(self.files),
            digest=self.digest(),
            time_step=time_step,
            watched=_labelled(
                [found for found, body, top in every if body.free or not drives(body)][:MOST_WATCHED]
            ),
            keyframes=keyframes,
            bodies=len(every),
            stands_free=all(body.free for body in tops),
            assets=assets or {},
            driven=driven,
            gravity=gravity,
        )

    def digest(self) -> str:
        """Over the content of all files and where they lie beside the first one."""
        main = self.path.resolve().parent
        total = hashlib.sha256()
        for file in sorted(self.files, key=lambda f: Path(_beside(f, main)).as_posix()):
            total.update(f"{_beside(file, main)}\0".encode())
            total.update(hashlib.sha256(file.read_bytes()).digest())
        return total.hexdigest()[:16]


def _resolved(path: Path) -> Path:
    """Where a path leads to."""
    try:
        return path.resolve()
    except (RuntimeError, OSError):  # links that lead to each other; the first until Python 3.13
        raise ModelError(f"{path} is a link that leads nowhere") from None


def _copies(element: ElementTree.Element) -> float:
    """What its counts ask for."""
    return product_of(element.get("count", "1"))


def _where(said: str, *files: Path) -> str:
    """The first of these files that says something, and its line; else the first."""
    for file in files:
        text = file.read_text(encoding="utf-8-sig", errors="replace")
        if (place := text.find(said)) >= 0:
            return f"{file}, line {text.count(chr(10), 0, place) + 1},"
    return str(files[0])


def _room(element: ElementTree.Element) -> float:
    """How many numbers it asks for beside what files hold; what is no number is left to the engine."""
    asked: dict[str, float] = {}
    kept = [name for name in element.attrib if name.startswith(KEPT)] if element.tag == "size" else []
    for name in (*ROOM.get(element.tag, ()), *kept):
        try:
            asked[name] = float(element.get(name, "0"))
        except ValueError:
            return 0.0
    return ROW * max(asked.values(), default=0.0) if element.tag == "size" else math.prod(asked.values())


def _beside(file: Path, main: Path) -> str:
    """Where a file lies seen from the first one."""
    return Path(os.path.relpath(file, main)).as_posix()


def _local(name: str) -> str:
    """Where in its package: package://name/meshes/a.stl -> meshes/a.stl."""
    return name.partition("://")[2].partition("/")[2] if name.startswith(IN_PACKAGES) else name


def _step(text: str | None, path: Path) -> float:
    try:
        step = float(text or "")
    except ValueError:
        raise ModelError(f"{path}: its time step is {text!r}, which is no number") from None
    if not SHORTEST <= step <= 1.0:
        raise ModelError(f"{path}: its time step is {step:g} s")
    return step


def _gravity(texts: list[str | None], path: Path) -> tuple[float, float, float]:
    """The last one that is named."""
    named = [text for text in texts if text]
    try:
        x, y, z = map(float, named[-1].split()) if named else GRAVITY
    except ValueError:
        raise ModelError(f"{path}: its gravity is {named[-1][:60]!r}, which is no three numbers") from None
    if not math.hypot(x, y, z) <= STRONGEST:
        raise ModelError(f"{path}: its gravity is {named[-1][:60]!r}; it may be {STRONGEST:g} m/s² at most")
    return x, y, z


def _labelled(found: list[Watched]) -> tuple[Watched, ...]:
    """Each label once: a name that replicate or attach would make twice keeps its first body."""
    return tuple({one.label: one for one in found}.values())
