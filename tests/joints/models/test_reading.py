"""What is read of a model file besides accelerations: the Python file, keyframes, counts of what is left out, and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

pytest.importorskip("mujoco")

import mujoco

import daebench
from daebench.joints.models.left_out import LeftOut

MODELS = Path(__file__).parents[2] / "models"

BODY = '<inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>'


def of(tmp_path, bodies, rest=""):
    """Return the path of a model with these bodies."""
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody>{rest}</mujoco>")
    return path


@pytest.mark.parametrize("name", ["five_bar.xml", "geared_plane.xml", "slider.xml"])
@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
def test_the_file_that_is_written_defines_the_same_equations(name):
    model = daebench.read_model(MODELS / name)
    space = {}
    exec(model.text, space)
    written, read = space["problem"](), model.problem()
    assert (written.g, written.U, written.M, written.force) == (read.g, read.U, read.M, read.force)
    assert {case: (x.q, x.p) for case, x in written.cases.items()} == {case: (x.q, x.p) for case, x in read.cases.items()}


@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
def test_a_keyframe_has_the_energy_that_mujoco_says():
    path = MODELS / "driven_arm.xml"
    m = mujoco.MjModel.from_xml_path(str(path))
    m.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    d = mujoco.MjData(m)
    energies = []
    for qpos, qvel in ((m.qpos0, np.zeros(m.nv)), (m.key_qpos[0], m.key_qvel[0])):
        d.qpos[:], d.qvel[:] = qpos, qvel
        mujoco.mj_forward(m, d)
        energies.append(d.energy.sum())
    problem = daebench.read_model(path).problem()
    found = []
    for name in ("reference", "reach"):
        case = problem.cases[name]
        q, p = (np.array([float(x) for x in side]) for side in (case.q, case.p))
        M = np.array(problem.M.subs(dict(zip(problem.q, case.q, strict=True))), dtype=float)
        found.append(float(problem.U.subs(dict(zip(problem.q, q, strict=True)))) + p @ np.linalg.solve(M, p) / 2)
    # Potentials are known up to a constant.
    assert found[1] - found[0] == pytest.approx(energies[1] - energies[0], rel=1e-10)
    assert problem.cases["reach"].parameters["wrist_control"] == 2


def test_open_loops_are_closed_and_it_is_said_how_far(recwarn):
    model = daebench.read_model(MODELS / "five_bar.xml")
    left, closed = (str(warning.message) for warning in recwarn if warning.category is LeftOut)
    assert "4 geoms with contacts" in left
    assert all(said in closed for said in ("keyframe open", "0.116", "0.174"))
    assert set(model.mechanism.cases) == {"reference", "open", "moving"}


def test_all_that_is_left_out_is_counted(tmp_path):
    bodies = '<geom size="1"/><site name="o" pos="1 0 0"/>'
    bodies += f'<body><joint name="j" range="-1 1" limited="true" frictionloss="1"/>{BODY}<site name="s"/></body>'
    rest = """<tendon><spatial name="t" stiffness="1"><site site="s"/><site site="o"/></spatial></tendon>
    <actuator><motor joint="j" ctrllimited="true" ctrlrange="-1 1"/><motor tendon="t"/>
    <intvelocity joint="j" kp="1" actrange="-1 1"/></actuator>"""
    with pytest.warns(LeftOut, match="left out"):
        model = daebench.read_model(of(tmp_path, bodies, rest))
    assert model.left_out == {
        "geoms with contacts": 1,
        "joint limits": 1,
        "joints with friction": 1,
        "tendons": 1,
        "control ranges": 1,
        "actuators with dynamics": 1,
        "actuators of other kinds": 2,
    }


MISTAKES = {
    "no XML": ("<mujoco", "model-not-xml"),
    "SDF": ("<sdf/>", "model-format-unread"),
    "another program's": ("<model/>", "model-root-element"),
    "what MuJoCo refuses": ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "model-refused-by-mujoco"),
    "nothing that moves": ('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>', "model-without-motion"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_file_that_is_no_model_is_refused_in_one_sentence(tmp_path, mistake):
    text, code = MISTAKES[mistake]
    (tmp_path / "model.xml").write_text(text)
    with refused(code, says=["model.xml"]):
        daebench.read_model(tmp_path / "model.xml")


REFUSED = {
    "joints in another arrangement": (
        f'<body><joint/><joint type="slide" axis="1 0 0"/><joint axis="0 1 0"/>{BODY}</body>',
        "",
        "joint-arrangement-unread",
        "body",
    ),
    "damping of a ball": (f'<body><joint type="ball" damping="1"/>{BODY}</body>', "", "joint-feature-unread", "damping"),
    "spring of a cross": (f'<body><joint stiffness="1"/><joint axis="0 1 0"/>{BODY}</body>', "", "joint-feature-unread", "stiffness"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_parts_without_a_counterpart_are_refused_in_one_sentence(tmp_path, name):
    bodies, rest, code, what = REFUSED[name]
    with refused(code, says=[what]):
        daebench.read_model(of(tmp_path, bodies, rest))


def test_a_urdf_whose_mimic_elements_are_skipped_is_refused(monkeypatch):
    path = MODELS / "gripper.urdf"
    without = mujoco.MjModel.from_xml_string(path.read_text().replace("<mimic", "<other"))
    monkeypatch.setattr("daebench.joints.models.compiled._urdf", lambda *_: (without, ()))
    with refused("mimic-elements-unread", says=["0", "2"]):
        daebench.read_model(path)


@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
def test_a_urdf_without_its_meshes_is_read_without_geometry():
    model = daebench.read_model(MODELS / "leg.urdf")
    assert "2 elements" in model.remarks[0]
    assert [*model.mechanism.bodies] == ["hip", "thigh", "shank"]


@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
@pytest.mark.usefixtures("uncompiled_schemes")
def test_a_model_is_imported_and_named_as_a_problem(daebench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart_pole.xml").write_bytes((MODELS / "cart_pole.xml").read_bytes())
    status, out, _ = daebench("import", "cart_pole.xml", "--out", "cart.py", "--json")
    assert (status, json.loads(out)["cases"]) == (0, ["reference"])
    ends = []
    for name in ("./cart_pole.xml", "./cart.py"):
        words = ["run", name, "--method", "rattle", "--h", "0.01", "--t-end", "0.1", "--json"]
        status, out, _ = daebench(*words)
        assert status == 0
        ends.append(json.loads(out)["q"])
    assert ends[0] == ends[1]


@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
def test_a_file_of_another_kind_is_not_replaced(daebench, tmp_path):
    out = tmp_path / "mine.py"
    out.write_text("x = 1\n")
    status, _, said = daebench("import", MODELS / "five_bar.xml", "--out", out)
    assert (status, out.read_text()) == (2, "x = 1\n")
    assert "--overwrite" in said
    assert daebench("import", MODELS / "five_bar.xml", "--out", out, "--overwrite")[0] == 0
    assert daebench("import", MODELS / "five_bar.xml", "--out", out)[0] == 0
