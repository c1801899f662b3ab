"""Environments based on pictura.Simulator, with the interfaces of Gymnasium, PettingZoo, TorchRL and PufferLib.

Each environment needs the library that defines its interface. pictura.envs.batch and DrivePufferEnv need no library.
"""

from pictura.envs.batch import Batch  # noqa: F401


def register() -> None:
    """Registers pictura/Drive-v0 and pictura/Log-v0 with Gymnasium. `import pictura` calls this if Gymnasium is
    installed."""
    from gymnasium.envs.registration import register as register_with_gymnasium
    from gymnasium.envs.registration import registry

    if "pictura/Drive-v0" in registry:
        return
    register_with_gymnasium(
        id="pictura/Drive-v0",
        entry_point="pictura.envs.gymnasium_env:DriveEnv",
        vector_entry_point="pictura.envs.gymnasium_vector:DriveVectorEnv",
    )
    register_with_gymnasium(id="pictura/Log-v0", entry_point="pictura.envs.gymnasium_env:LogEnv")
