"""What is said of a model file without an engine: its files, their hash, its bodies; and what is refused, in a sentence."""

from __future__ import annotations

import struct
import time
from pathlib import Path

import pytest

from spook_tracker.engine import model_reading
from spook_tracker.engine.model_bodies import DEEPEST, ModelError
from spook_tracker.engine.model_reading import Reading, folder_of, read

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
    assert found.assets == {
        "package://arm_description/meshes/upper.stl": (
            tmp_path / "arm_description/meshes/upper.stl"
        ).resolve()
    }


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


ATTACHED = """<mujoco><asset><model name="part" file="parts/arm.xml"/></asset><worldbody>
<frame pos="0 1 0"><attach model="part" body="upper" prefix="left_"/></frame>
<attach model="part" prefix="right_"/></worldbody></mujoco>"""
PART = """<mujoco model="arm"><default><default class="loose"><joint type="free"/></default></default>
<worldbody><body name="upper"><joint/><geom size=".1"/><body name="fore"><joint/><geom size=".1"/></body></body>
<body name="nut" childclass="loose"><joint/><geom size=".1"/></body></worldbody></mujoco>"""
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
        ('<mujoco><size nuser_geom="10000000"/><worldbody><body/></worldbody></mujoco>', "asks for 1e\\+09 numbers"),
        ('<mujoco><sensor><user dim="2000000000"/></sensor></mujoco>', "<user> asks for 2e\\+09 numbers"),
        ('<mujoco><option noslip_iterations="2000000000"/></mujoco>', "asks for 2000000000 noslip_iterations in a step"),
        (CART.replace("wheel.stl", "../parts/bomb.png"), "bomb.png is a picture of 30000 by 30000 points"),
        ('<mujoco><asset><hfield nrow="60000" ncol="60000"/></asset></mujoco>', "asks for 3.6e\\+09 numbers"),
        ('<mujoco><option timestep="1e-12"/><worldbody><body><joint/></body></worldbody></mujoco>', "time step is 1e-12"),
        ("version https://git-lfs.github.com/spec/v1", "pointer of Git LFS"),
        ("<html/>", "begins with <html>"),
        ("<mujocoinclude/>", "no model by itself"),
        ("<mujoco><asset/></mujoco>", "part for inclusion"),
        ('<mujoco><worldbody><geom type="plane"/></worldbody></mujoco>', "nothing in"),
        ('<mujoco><option timestep="fast"/><worldbody><body><joint/></body></worldbody></mujoco>', "no number"),
        ('<mujoco><option timestep="nan"/><worldbody><body><joint/></body></worldbody></mujoco>', "time step is nan"),
        ('<mujoco><option gravity="0 0 -inf"/><worldbody><body><joint/></body></worldbody></mujoco>', "may be 1e\\+09 m/s² at most"),
        (CART.replace("<mujoco", '\n<mujoco', 1).replace("<worldbody>", '<default><geom mass="nan"/></default><worldbody>'), r"robot.xml, line \d, gives a mass of nan"),
        ('<mujoco><default><geom density="-1"/></default><worldbody><body><joint/></body></worldbody></mujoco>', "density of -1, which is negative"),
        ('<mujoco><worldbody><body><joint/><inertial mass="1" diaginertia="1 1e308 1"/></body></worldbody></mujoco>', "moment of inertia of 1e\\+308; it may be 1e\\+100 at most"),
        ('<mujoco><worldbody><body><joint/><inertial mass="1" fullinertia="1 1 -1 0 0 0"/></body></worldbody></mujoco>', "inertia of -1"),
        ('<robot><joint>\n<axis xyz="-1"/></joint><link name="a">\n<inertial><mass value="-1"/></inertial></link></robot>', "line 3, gives a mass of -1, which is negative"),
        ('<robot><link name="a"><inertial>\n<mass\nvalue="1e308"/></inertial></link></robot>', "line 3, gives a mass of 1e\\+308"),
        ('<robot><link name="a"><inertial><inertia ixx="1" iyy="inf" izz="1"/></inertial></link></robot>', "moment of inertia of inf"),
        ('<sdf><model><link><inertial><mass>nan</mass></inertial></link></model></sdf>', "mass of nan, which is not finite"),
        ('<sdf><model><link><inertial><inertia><izz>-2</izz></inertia></inertial></link></model></sdf>', "moment of inertia of -2"),
        ('<mujoco><worldbody><include file="gone.xml"/></worldbody></mujoco>', "gone.xml, which is no file"),
        ('<mujoco><worldbody><include file="robot.xml"/></worldbody></mujoco>', "which includes it"),
        ('<mujoco><worldbody><include/></worldbody></mujoco>', "does not name"),
        (CART.replace("meshes", "elsewhere"), r"robot.xml, line 2, names .*elsewhere.wheel.stl, which is no file"),
        ('<mujoco><worldbody><include file="parts\\gone.xml"/></worldbody></mujoco>', "parts/gone.xml, which is no file"),
        (
            '<mujoco><include file="parts/hand.xml"/></mujoco>',
            r"hand.xml, line 2, names .*elsewhere.wheel.stl, which is no file",
        ),
        (ATTACHED.replace("arm.xml", "loop.xml"), "loop.xml, which attaches it"),
        (ATTACHED.replace("arm.xml", "doubled0.xml"), r"includes or attaches more than 1e\+04 elements"),
        ("<mujoco><worldbody>" + '<replicate count="10000"><body/></replicate>' * 60 + "</worldbody></mujoco>", "elements with all copies"),
        ('<robot xmlns:x="http://www.ros.org/wiki/xacro"><x:include filename="arm.xacro"/></robot>', "robot.xml is a xacro"),
        (CART.replace("wheel.stl", "../../secret.stl"), "lies outside"),
        (CART.replace("wheel.stl", "/etc/passwd"), r"line 2, names /etc/passwd, which lies outside"),
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, said: str
) -> None:
    monkeypatch.setattr(model_reading, "MOST_ELEMENTS", 10_000)  # there is no need to read a million
    (tmp_path / "secret.stl").write_text("x")
    (tmp_path / "secret.xml").write_text("<mujocoinclude/>")
    (tmp_path / "models/meshes").mkdir(parents=True)
    (tmp_path / "models/parts").mkdir()
    (tmp_path / "models/parts/ball.xml").write_text(BALL)
    (tmp_path / "models/parts/model.sdf").write_text(
        "<sdf><model><mesh><uri>../../secret.stl</uri></mesh></model></sdf>"
    )
    (tmp_path / "models/parts/bomb.dae").write_text(BOMB)
    (tmp_path / "models/parts/bomb.png").write_bytes(
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 30000, 30000)
    )
    (tmp_path / "models/parts/hand.xml").write_text(CART.replace("meshes", "elsewhere"))
    (tmp_path / "models/parts/torn.dae").write_bytes(b"<COLLADA\xff\x00")
    (tmp_path / "models/parts/loop.xml").write_text(ATTACHED.replace("parts/arm.xml", "loop.xml"))
    for k in range(21):
        twice = ATTACHED.replace("parts/arm.xml", f"doubled{k + 1}.xml").replace(' body="upper"', "")
        (tmp_path / f"models/parts/doubled{k}.xml").write_text(twice if k < 20 else PART)
    for name, face in (("far", "1/1/1 2//1 9"), ("word", "1 2 x")):
        (tmp_path / f"models/parts/{name}.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n")
    file = tmp_path / "models/robot.xml"
    file.write_text(text)

    with pytest.raises(ModelError, match=said) as raised:
        read(file)

    assert "\n" not in str(raised.value)
    assert any(
        name in str(raised.value)
        for name in ("robot.xml", "hand.xml", "loop.xml", "model.sdf", ".dae", ".obj", ".png")
    )


def _names(found: Reading) -> list[str]:
    return [one.name for one in found.watched]


def test_bodies_that_are_attached_or_replicated_are_watched_by_the_names_they_get(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/arm.xml").write_text(PART)
    file = tmp_path / "robot.xml"
    file.write_text(ATTACHED)
    found = read(file)

    assert _names(found) == ["left_fore", "right_fore", "right_nut"]
    assert (found.bodies, len(found.files), found.stands_free) == (5, 2, False)
    ball = '<replicate count="2"><replicate count="10" sep="-"><body name="ball"><freejoint/><geom size=".1"/></body></replicate></replicate>'
    file.write_text(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
    found = read(file)
    assert (found.bodies, found.stands_free) == (20, True)
    assert _names(found)[:2] == ["ball-000", "ball-010"]  # as MuJoCo has them: the inner number first
    file.write_text(PART.replace('<body name="upper"><joint/>', '<body name="upper">'))
    assert [(one.name, read(file).stands_free) for one in read(file).watched] == [
        ("fore", False),
        ("nut", False),
    ]


def test_what_is_made_by_elements_alone_moves(tmp_path: Path) -> None:
    """A cable, which releases before 4 have, and a soft grid with a corner that is held."""
    file = tmp_path / "soft.xml"
    file.write_text(
        '<mujoco><worldbody><composite type="cable" prefix="C" count="11 1 1" initial="none"/></worldbody></mujoco>'
    )
    assert (_names(read(file)), read(file).bodies) == (["CB_last"], 9)
    file.write_text(
        '<mujoco><worldbody><flexcomp name="soft" count="2 2 1"><pin id="0 3"/></flexcomp></worldbody></mujoco>'
    )
    assert [one.path for one in read(file).watched] == [(0,), (1,)]
    file.write_text('<mujoco><worldbody><flexcomp name="stiff" rigid="true"/></worldbody></mujoco>')
    with pytest.raises(ModelError, match="nothing in"):
        read(file)


def test_links_of_an_sdf_hang_from_the_world_and_share_names_between_models(tmp_path: Path) -> None:
    file = tmp_path / "world.sdf"
    hung = '<joint type="{}"><parent>world</parent><child>bar</child></joint>'
    bar = '<sdf><model name="bar"><link name="bar"/>{}</model></sdf>'
    file.write_text(bar.format(hung.format("revolute")))
    assert (_names(read(file)), read(file).stands_free) == (["bar"], False)
    file.write_text(bar.format(hung.format("fixed")))
    with pytest.raises(ModelError, match="nothing in"):
        read(file)
    (tmp_path / "box").mkdir()
    (tmp_path / "box/model.sdf").write_text('<sdf><model name="box"><link name="link"/></model></sdf>')
    box = "<include><uri>model://box</uri>{}</include>"
    floor = '<model name="floor"><static>true</static><link name="link"/></model>'
    one, other = box.format(""), box.format("<name>other</name>")
    still = box.format("<name>still</name><static>1</static>")
    file.write_text(f'<sdf><world name="w">{floor}{one}{other}{still}</world></sdf>')
    found = read(file)
    assert (_names(found), found.stands_free) == (["box::link", "other::link"], True)


def test_a_urdf_says_to_mujoco_where_its_meshes_are(tmp_path: Path) -> None:
    """By the compiler element that MuJoCo reads; else beside the file, also of a model:// as Gazebo has it."""
    (tmp_path / "arm_description/meshes").mkdir(parents=True)
    (tmp_path / "arm_description/package.xml").write_text("")
    (tmp_path / "arm_description/meshes/upper.stl").write_text("x")
    file = tmp_path / "arm_description/arm.urdf"
    for name, head in (
        ("upper.stl", '<mujoco><compiler meshdir="meshes"/></mujoco>'),
        ("package://arm_description/elsewhere/upper.stl", '<mujoco><compiler meshdir="meshes"/></mujoco>'),
        ("model://arm_description/meshes/upper.stl", ""),
    ):
        text = ARM.replace('<robot name="arm">', f'<robot name="arm">{head}')
        file.write_text(text.replace("package://arm_description/meshes/upper.stl", name))

        assert {key: path.name for key, path in read(file).assets.items()} == {name: "upper.stl"}


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


def test_products_of_inertia_may_be_negative_and_moments_by_rounding(cart: Path) -> None:
    cart.write_text(
        '<mujoco><worldbody><body name="a"><joint/><inertial pos="0 0 0" mass="1" fullinertia="1 1 1 -.1 -.1 -.1"/></body></worldbody></mujoco>'
    )
    assert [one.name for one in read(cart).watched] == ["a"]
    cart.write_text(
        '<robot name="r"><link name="b"/><link name="a"><inertial><mass value="0"/><inertia ixx="-5e-20" iyy="1" izz="1" ixy="-.1"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="b"/><child link="a"/></joint></robot>'
    )
    assert [one.name for one in read(cart).watched] == ["a"]


def test_a_link_of_an_sdf_may_say_whether_gravity_pulls_at_it(tmp_path: Path) -> None:
    """<gravity> of a link is a flag, of the world a vector."""
    file = tmp_path / "robot.sdf"
    for world, pull in (("<gravity>0 0 -1.6</gravity>", (0.0, 0.0, -1.6)), ("", (0.0, 0.0, -9.81))):
        file.write_text(
            f'<sdf><world>{world}<model><link name="a"><gravity>1</gravity></link></model></world></sdf>'
        )
        assert read(file).gravity == pull
