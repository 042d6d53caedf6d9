"""Time of one step of the chair with each formula family on its four wheels.

    python benchmarks/tire_families.py

The shortest of several runs, measured alternately, so that other work disturbs all in the same way.
"""

import time

import mujoco
from mf_equations import book

import mjchair
from mjchair.tire import Tire

STEPS = 4000
ROUNDS = 15


def families() -> dict[str, Tire | str]:
    own = {"relaxation_x": 0.0, "relaxation_y": 0.0, "damping_time": 0.001}
    numbers = book(LATERAL_STIFFNESS=1e5, LONGITUDINAL_STIFFNESS=3e5)
    return {
        "pac89": "wheelchair",
        "linear": "linear",
        "mf61": Tire("mf61", "mf61", numbers, nominal_load=4000.0, **own),
        "mf52": Tire("mf52", "mf52", book(), nominal_load=4000.0, **own),
    }


def main() -> None:
    runs = {}
    for name, tire in families().items():
        casters = "caster" if isinstance(tire, str) else tire
        spec = mjchair.load_spec("manual", tire={"wheels": tire, "casters": casters})
        model = spec.compile()
        data = mujoco.MjData(model)
        runs[name] = (model, data)
    least = dict.fromkeys(runs, float("inf"))
    with mjchair.installed():
        for _ in range(ROUNDS):
            for name, (model, data) in runs.items():
                mujoco.mj_resetData(model, data)
                data.ctrl[:2] = 6.0
                mujoco.mj_step(model, data, 500)
                begin = time.perf_counter()
                mujoco.mj_step(model, data, STEPS)
                least[name] = min(least[name], (time.perf_counter() - begin) / STEPS)
    print("family   us a step   of PAC89")
    for name, seconds in least.items():
        print(f"{name:<8} {1e6 * seconds:>9.2f} {seconds / least['pac89']:>10.2f}")


if __name__ == "__main__":
    main()
