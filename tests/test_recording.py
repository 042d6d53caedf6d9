import dataclasses
import zipfile

import mujoco
import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.simulation.recording import Recording, Status, load_recording
from mjchair.simulation.stored_model import StoredModel
from mjchair.simulation.table import read_table

XML = "<mujoco><worldbody><body><joint name='j'/><geom size='0.1'/></body></worldbody></mujoco>"


def recording(**changes):
    time = np.linspace(0.0, 1.0, 5)
    parts = {
        "time": time,
        "channels": {"left_wheel_speed": time**2, "chair/left_wheel_tire.Fx": -time},
        "units": {"left_wheel_speed": "rad/s", "chair/left_wheel_tire.Fx": "N"},
        "controls": {"left_wheel": np.ones(5)},
        "qpos": time[:, None],
        "qvel": np.ones((5, 1)),
        "model": StoredModel("xml", XML.encode()),
        "timestep": 0.25,
        "versions": {"mujoco": "3.17.0"},
    }
    return Recording(**(parts | changes))


def test_what_is_saved_comes_back(tmp_path):
    run = recording(status=Status.UNSTABLE, stopped_at=1.25, reason="too fast")
    run.save(tmp_path / "run.npz")
    back = load_recording(tmp_path / "run.npz")
    for field in dataclasses.fields(Recording):
        one, two = getattr(run, field.name), getattr(back, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, two)
        elif field.name in ("channels", "controls"):
            assert list(one) == list(two)
            for name in one:
                np.testing.assert_array_equal(one[name], two[name])
        else:
            assert one == two, field.name
    assert back.model.load().njnt == 1


def test_nothing_in_the_file_is_pickled(tmp_path):
    recording().save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as file:
        assert all(file[name].dtype != object for name in file.files)
    assert zipfile.ZipFile(tmp_path / "run.npz").testzip() is None


def test_the_csv_is_a_table_of_the_contract(tmp_path):
    run = recording()
    run.to_csv(tmp_path / "run.csv")
    table = read_table(tmp_path / "run.csv")
    assert list(table.columns) == ["left_wheel", "left_wheel_speed", "chair/left_wheel_tire.Fx"]
    np.testing.assert_allclose(table.columns["left_wheel_speed"], run["left_wheel_speed"])


def test_a_missing_sample_is_an_empty_cell(tmp_path):
    speed = np.array([0.0, np.nan, 2.0, 3.0, 4.0])
    recording(channels={"speed": speed}, units={"speed": "m/s"}).to_csv(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[2] == "0.25,1,"


def test_channels_are_found_behind_a_prefix_and_unknown_ones_named():
    run = recording()
    np.testing.assert_array_equal(run["left_wheel_tire.Fx"], -run.time)
    assert run.wheels == ["chair/left_wheel"]
    with pytest.raises(MjchairError, match="no channel 'left_wheel_sped'; did you mean"):
        run["left_wheel_sped"]


def test_it_is_frozen():
    run = recording()
    with pytest.raises(ValueError):
        run["left_wheel_speed"][0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        run.timestep = 1.0


def test_lengths_must_agree():
    with pytest.raises(MjchairError, match="5 samples"):
        recording(qpos=np.zeros((4, 1)))


def test_its_words_say_how_it_ended():
    assert recording().describe() == "completed: 1 s, 5 samples"
    run = recording(status=Status.UNSTABLE, stopped_at=1.25, reason="too fast")
    assert run.describe() == "unstable at 1.25 s (too fast): 1 s, 5 samples kept"


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04broken"])
def test_other_files_are_refused_in_one_line(tmp_path, content):
    (tmp_path / "run.npz").write_bytes(content)
    with pytest.raises(MjchairError, match=r"is not an mjchair recording") as caught:
        load_recording(tmp_path / "run.npz")
    assert "\n" not in str(caught.value)


def test_other_npz_files_and_missing_ones_are_refused(tmp_path):
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(MjchairError, match="is not an mjchair recording"):
        load_recording(tmp_path / "other.npz")
    with pytest.raises(MjchairError, match="no recording"):
        load_recording(tmp_path / "none.npz")


def test_a_failed_save_leaves_nothing(tmp_path):
    with pytest.raises(MjchairError, match=r"saved as \.npz"):
        recording().save(tmp_path / "run.pkl")
    with pytest.raises(MjchairError, match="cannot write"):
        recording().save(tmp_path / "nowhere" / "run.npz")
    assert not list(tmp_path.iterdir())


def test_a_spec_is_stored_as_xml_and_a_model_as_mjb():
    spec = mujoco.MjSpec.from_string(XML)
    model = spec.compile()
    assert StoredModel.of(model, spec).form == "xml"
    stored = StoredModel.of(model)
    assert stored.form == "mjb"
    assert stored.load().njnt == 1
    with pytest.raises(MjchairError, match="does not load"):
        StoredModel("xml", b"<mujoco").load()


def test_a_damaged_model_leaves_no_log_of_the_engine(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    whole = StoredModel.of(mujoco.MjModel.from_xml_string(XML))
    with pytest.raises(MjchairError, match="does not load"):
        StoredModel("mjb", whole.content[:1000]).load()
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())
