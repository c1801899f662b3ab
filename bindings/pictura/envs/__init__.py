"""Environments over pictura.Simulator, in the forms of Gymnasium, PettingZoo, TorchRL and PufferLib.

Each needs the library whose form it has; pictura.envs.batch needs none.
"""

from pictura.envs.batch import Batch  # noqa: F401


def register() -> None:
    """Registers pictura/Drive-v0 with Gymnasium, which calls this as a plugin."""
    import gymnasium

    if "pictura/Drive-v0" in gymnasium.registry:
        return
    gymnasium.register(
        id="pictura/Drive-v0",
        entry_point="pictura.envs.gymnasium_env:DriveEnv",
        vector_entry_point="pictura.envs.gymnasium_vector:DriveVectorEnv",
    )
