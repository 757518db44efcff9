"""The oracle planner: the environment's own subgoals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

Subgoals = Literal["grounded", "simple"]


class OracleOptions(BaseModel):
    """Options of the oracle planner.

    Attributes:
        subgoals: ``grounded``, with pixels of the objects, or ``simple``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    subgoals: Subgoals = "grounded"


class OraclePlanner:
    """Returns the judge's current stage as a subgoal. Privileged."""

    options_type: ClassVar[type[BaseModel]] = OracleOptions
    version = "built-in"

    def __init__(self, options: OracleOptions | None = None) -> None:
        self.options = options or OracleOptions()
        self.grounded = self.options.subgoals == "grounded"
        self._env: RoboIRGEnv | None = None

    @property
    def metadata(self) -> dict[str, Any]:
        return {"kind": "oracle", **self.options.model_dump(mode="json")}

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment.

        Raises:
            InvalidValueError: it does not provide pixels, which grounded subgoals need.
        """
        if self.grounded and not env.grounded:
            raise InvalidValueError(
                "The oracle planner needs pixels, which the environment does not provide; make it "
                "with grounded=True, or set subgoals=simple."
            )
        self._env = env

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Do nothing: there is no state."""

    def plan(self, observation: Observation, step: int) -> str:  # noqa: ARG002
        """Return the current stage in words."""
        if self._env is None:
            raise RuntimeError("OraclePlanner needs attach(env) before plan().")
        return self._env.subgoal
