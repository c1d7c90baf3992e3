"""What is said of a model file without an engine: its files, their hash, its bodies; and what is refused, in a sentence."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from spook_tracker.engine.model_bodies import DEEPEST, ModelError
from spook_tracker.engine.model_reading import folder_of, read

CART = """<mujoco><compiler meshdir="meshes"/><option timestep=".004"/>
<asset><mesh name="wheel" file="wheel.stl"/></asset>
<worldbody><geom type="plane" size="1 1 1"/>
  <body name="cart"><joint type="slide" axis="1 0 0"/><geom type="box" size=".1 .1 .1"/>
    <body><joint type="hinge"/><geom type="sphere" size=".1"/><body name="tip" pos="0 0 1"/></body>
  </body>
  <include file="parts/ball.xml"/>
</worldbody><keyframe><key name="home"/><key/></keyframe></mujoco>"""
BALL = '<mujocoinclude><body name="ball"><freejoint/><geom type="sphere" size=".1"/></body></mujocoinclude>'
ARM = """<robot name="arm"><link name="base"/><link name="upper"><collision><geometry>
<mesh filename="package://arm_description/meshes/upper.stl"/></geometry></collision></link><link name="hand"/><link name="plate"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/></joint>
<joint name="wrist" type="continuous"><parent link="upper"/><child link="hand"/></joint>
<joint name="glue" type="fixed"><parent link="hand"/><child link="plate"/></joint></robot>"""


@pytest.fixture
def cart(tmp_path: Path) -> Path:
    for name, text in {
        "tracker.toml": "",
        "robots/cart.xml": CART,
        "robots/parts/ball.xml": BALL,
        "robots/meshes/wheel.stl": "a mesh",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path / "robots/cart.xml"


def test_a_model_is_all_its_files_and_their_content_is_its_hash(cart: Path, tmp_path: Path) -> None:
    found = read(cart)

    assert {file.name for file in found.files} == {"cart.xml", "ball.xml", "wheel.stl"}
    (cart.parent / "meshes/wheel.stl").write_text("another mesh")
    assert read(cart).digest != found.digest
    (cart.parent / "meshes/wheel.stl").write_text("a mesh")
    cart.parent.rename(tmp_path / "moved")
    assert read(tmp_path / "moved/cart.xml").digest == found.digest  # where it lies makes no other model


def test_watched_are_free_bodies_and_the_ends_of_chains(cart: Path) -> None:
    found = read(cart)

    assert [(one.label, one.name, one.path) for one in found.watched] == [
        ("cart.0", "cart", (0,)),  # it has no name of its own; the tip on it has no joint
        ("ball", "ball", ()),
    ]
    assert (found.time_step, found.bodies, found.keyframes) == (0.004, 3, ("home", "1"))
    assert not found.stands_free  # the cart hangs on its rail


def test_a_urdf_finds_its_packages_and_its_last_moving_link(tmp_path: Path) -> None:
    (tmp_path / "arm_description/meshes").mkdir(parents=True)
    (tmp_path / "arm_description/urdf").mkdir()
    (tmp_path / "arm_description/package.xml").write_text("")
    (tmp_path / "arm_description/meshes/upper.stl").write_text("x")
    file = tmp_path / "arm_description/urdf/arm.urdf"
    file.write_text(ARM)

    found = read(file)

    assert [one.label for one in found.watched] == ["hand"]
    assert found.assets == {"upper.stl": (tmp_path / "arm_description/meshes/upper.stl").resolve()}


def test_a_model_belongs_to_its_repository_or_installed_package(tmp_path: Path) -> None:
    (tmp_path / "site-packages/robots/arms").mkdir(parents=True)

    assert folder_of(tmp_path / "site-packages/robots/arms/a.xml") == tmp_path / "site-packages/robots"
    assert folder_of(tmp_path / "a.xml") == tmp_path


def _nested(levels: int) -> str:
    return "<mujoco><worldbody>" + "<body>" * levels + "</body>" * levels + "</worldbody></mujoco>"


def _chain(links: int, more: str = "") -> str:
    """A URDF in which each link hangs from the one before."""
    joints = (
        f'<joint name="{k}"><parent link="{k - 1}"/><child link="{k}"/></joint>' for k in range(1, links)
    )
    return (
        "<robot>" + "".join(f'<link name="{k}"/>' for k in range(links)) + "".join(joints) + f"{more}</robot>"
    )


BOMB = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><mujoco><worldbody><body name="&b;"/></worldbody></mujoco>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco", "is no XML"),
        ("", "is no XML"),
        ("\0\1\2", "no text in UTF-8"),
        (BOMB, "declares XML entities"),
        (_nested(DEEPEST + 1), "nested deeper"),
        ('<mujoco><worldbody><replicate count="1000000000"><body/></replicate></worldbody></mujoco>', "makes 1e\\+09 copies"),
        (
            '<mujoco><worldbody><replicate count="1000"><replicate count="1000"><body/></replicate></replicate></worldbody></mujoco>',
            "makes 1e\\+06 copies",
        ),
        ('<mujoco><size nkey="10000000"/><worldbody><body/></worldbody></mujoco>', "asks for 1e\\+09 numbers"),
        ('<mujoco><asset><hfield nrow="60000" ncol="60000"/></asset></mujoco>', "asks for 3.6e\\+09 numbers"),
        ('<mujoco><option timestep="1e-12"/><worldbody><body><joint/></body></worldbody></mujoco>', "time step is 1e-12"),
        ("version https://git-lfs.github.com/spec/v1", "pointer of Git LFS"),
        ("<html/>", "begins with <html>"),
        ("<mujocoinclude/>", "no model by itself"),
        ("<mujoco><asset/></mujoco>", "part for inclusion"),
        ('<mujoco><worldbody><geom type="plane"/></worldbody></mujoco>', "nothing in"),
        ('<mujoco><option timestep="fast"/><worldbody><body><joint/></body></worldbody></mujoco>', "no number"),
        ('<mujoco><option timestep="nan"/><worldbody><body><joint/></body></worldbody></mujoco>', "time step is nan"),
        ('<mujoco><worldbody><include file="gone.xml"/></worldbody></mujoco>', "gone.xml, which is no file"),
        ('<mujoco><worldbody><include file="robot.xml"/></worldbody></mujoco>', "which includes it"),
        ('<mujoco><worldbody><include/></worldbody></mujoco>', "does not name"),
        (CART.replace("meshes", "elsewhere"), "wheel.stl, which is no file"),
        (CART.replace("wheel.stl", "../../secret.stl"), "lies outside"),
        (CART.replace("wheel.stl", "/etc/passwd"), "lies outside"),
        ('<mujoco><worldbody><include file="../secret.xml"/></worldbody></mujoco>', "lies outside"),
        ("<robot/>", "no links"),
        ('<robot><link name="a"/><joint name="j"><parent link="a"/><child link="b"/></joint></robot>', "ties link 'b'"),
        (
            '<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint></robot>',
            "make a circle",
        ),
        ('<robot><link name="a"/><link name="a"/></robot>', "two links 'a'"),
        (_chain(2, '<link name="b"/><joint name="again"><parent link="b"/><child link="1"/></joint>'), "'1' hangs from two joints"),
        (_chain(DEEPEST + 1), "hang from more than 200"),
        ('<sdf><include><uri>../secret.xml</uri></include></sdf>', "lies outside"),
        ('<sdf><include><uri>model://parts</uri></include></sdf>', "secret.stl, which lies outside"),
        ('<sdf><include><uri>robot.xml</uri></include></sdf>', "which includes it"),
        ('<sdf><model><link><mesh><uri>parts/bomb.dae</uri></mesh></link></model></sdf>', "bomb.dae declares XML entities"),
        ('<sdf><model><link><mesh><uri>parts/torn.dae</uri></mesh></link></model></sdf>', "torn.dae is no XML"),
        (CART.replace("wheel.stl", "../parts/far.obj"), "far.obj has a face with corner 9, of 3"),
        (CART.replace("wheel.stl", "../parts/word.obj"), "word.obj has faces of something else"),
        ('<sdf><model><link><mesh><uri>http://a/b.stl</uri></mesh></link></model></sdf>', "b.stl, which is no file"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_one_sentence_that_names_the_file(
    tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "secret.stl").write_text("x")
    (tmp_path / "secret.xml").write_text("<mujocoinclude/>")
    (tmp_path / "models/meshes").mkdir(parents=True)
    (tmp_path / "models/parts").mkdir()
    (tmp_path / "models/parts/ball.xml").write_text(BALL)
    (tmp_path / "models/parts/model.sdf").write_text(
        "<sdf><model><mesh><uri>../../secret.stl</uri></mesh></model></sdf>"
    )
    (tmp_path / "models/parts/bomb.dae").write_text(BOMB)
    (tmp_path / "models/parts/torn.dae").write_bytes(b"<COLLADA\xff\x00")
    for name, face in (("far", "1/1/1 2//1 9"), ("word", "1 2 x")):
        (tmp_path / f"models/parts/{name}.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n")
    file = tmp_path / "models/robot.xml"
    file.write_text(text)

    with pytest.raises(ModelError, match=said) as raised:
        read(file)

    assert "\n" not in str(raised.value)
    assert any(name in str(raised.value) for name in ("robot.xml", "model.sdf", ".dae", ".obj"))


@pytest.mark.parametrize(
    "face", ["1 2 3  # a comment", "1/1/1 2//2 3/3", "-1 -2 -3", "1 2 \\\n3", "1 2 3\n#f 9 9 9"]
)
def test_a_face_may_be_written_in_any_way_that_obj_has(cart: Path, face: str) -> None:
    (cart.parent / "meshes/wheel.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n")
    cart.write_text(cart.read_text().replace("wheel.stl", "wheel.obj"))

    assert {one.suffix for one in read(cart).files} >= {".obj"}


def test_an_entity_in_a_collada_of_another_encoding_is_found(tmp_path: Path) -> None:
    (tmp_path / "bomb.dae").write_bytes(f'<?xml version="1.0" encoding="utf-16"?>{BOMB}'.encode("utf-16"))
    file = tmp_path / "robot.sdf"
    file.write_text("<sdf><model><link><mesh><uri>bomb.dae</uri></mesh></link></model></sdf>")

    with pytest.raises(ModelError, match=r"bomb\.dae declares XML entities"):
        read(file)


@pytest.mark.parametrize(
    ("encoding", "content"),
    [("utf-16", BOMB), ("utf-16-le", BOMB), ("iso-8859-1", CART.replace('"tip"', '"Knöchel"'))],
)
def test_an_encoding_that_engines_do_not_read_is_refused(cart: Path, encoding: str, content: str) -> None:
    cart.write_bytes(f'<?xml version="1.0" encoding="{encoding}"?>{content}'.encode(encoding))

    with pytest.raises(ModelError, match=r"no text in UTF-8"):
        read(cart)


def test_an_sdf_is_all_the_files_it_includes_and_no_script_of_its_looks(tmp_path: Path) -> None:
    (tmp_path / "robots/wheel").mkdir(parents=True)
    (tmp_path / "robots/wheel/model.sdf").write_text(
        '<sdf><model><link name="hub"/><link name="rim"><mesh><uri>model://robots/rim.stl</uri></mesh></link>'
        '<joint type="revolute"><parent>hub</parent><child>rim</child></joint></model></sdf>'
    )
    (tmp_path / "robots/rim.stl").write_text("a mesh")
    (tmp_path / "tracker.toml").write_text("")
    file = tmp_path / "robots/cart.sdf"
    file.write_text(
        "<sdf><include><uri>model://wheel</uri></include><material><script><uri>file://gone.material</uri></script></material></sdf>"
    )
    found = read(file)

    assert {one.name for one in found.files} == {"cart.sdf", "model.sdf", "rim.stl"}
    assert [one.label for one in found.watched] == ["hub", "rim"]


def test_a_byte_order_mark_changes_nothing_but_the_hash(cart: Path) -> None:
    plain = read(cart)
    cart.write_bytes(b"\xef\xbb\xbf" + cart.read_bytes())

    assert read(cart).watched == plain.watched


def test_links_in_a_circle_lead_nowhere(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").symlink_to("robot.xml")

    with pytest.raises(ModelError, match=r"leads nowhere|is no file"):
        read(tmp_path / "robot.xml")


def test_a_link_out_of_the_folder_is_outside(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "real.xml").write_text(BALL)
    (tmp_path / "models/link.xml").symlink_to(tmp_path / "real.xml")
    (tmp_path / "models/robot.xml").write_text(
        '<mujoco><worldbody><include file="link.xml"/></worldbody></mujoco>'
    )

    with pytest.raises(ModelError, match="lies outside"):
        read(tmp_path / "models/robot.xml")


@pytest.mark.parametrize("name", ["robot.xml", "meshes/wheel.stl"])
def test_a_file_of_100_mb_is_refused_at_once(cart: Path, name: str) -> None:
    large = cart if name == "robot.xml" else cart.parent / name
    with large.open("r+b") as file:
        file.truncate(100_000_000)
    began = time.process_time()

    with pytest.raises(ModelError, match="has 100 MB"):
        read(cart)

    assert time.process_time() - began < 0.5  # s: it is not read
