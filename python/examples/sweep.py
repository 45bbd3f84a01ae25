"""The same sweep here, on two processes, on Dask and on Ray: the same table, bit for bit.

python examples/sweep.py [here|processes|dask|ray]
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import penny

SCENE = Path(__file__).resolve().parents[2] / "models" / "circle.xml"
GRID = {
    "law": ["penalty", "mujoco", "tutorial"],
    "timestep": [0.0005, 0.001, 0.002],
    "geom.1.friction": [[0.1, 0.005, 0.0001], [0.5, 0.005, 0.0001]],
}


def main(where="here"):
    if where == "processes":
        with ProcessPoolExecutor(2) as executor:
            table = penny.sweep(SCENE, GRID, executor=executor)
    elif where == "dask":
        from distributed import Client

        with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
            table = penny.sweep(SCENE, GRID, executor=client)
    elif where == "ray":
        import ray

        ray.init(num_cpus=2, include_dashboard=False)
        table = penny.sweep(SCENE, GRID, executor=ray)
        ray.shutdown()
    else:
        table = penny.sweep(SCENE, GRID)
    for row in table.rows:
        print({name: value for name, value in row.items() if name in (*GRID, "qpos0", "depth", "failed")})
    return table


if __name__ == "__main__":
    main(*sys.argv[1:])
