"""The oracle among planners: the environment's own subgoals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Demonstration, Observation

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

Subgoals = Literal["grounded", "simple"]


class OracleOptions(BaseModel):
    """How the oracle speaks.

    Attributes:
        subgoals: ``grounded``, with the pixels of what is meant, or ``simple``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    subgoals: Subgoals = "grounded"


class OraclePlanner:
    """Says what is to be done now, as the judge sees it. Privileged."""

    options_type: ClassVar[type[BaseModel]] = OracleOptions
    version = "built-in"

    def __init__(self, options: OracleOptions | None = None) -> None:
        self.options = options or OracleOptions()
        self.grounded = self.options.subgoals == "grounded"
        self._env: RoboIRGEnv | None = None

    @property
    def metadata(self) -> dict[str, Any]:
        """The options."""
        return {"kind": "oracle", **self.options.model_dump(mode="json")}

    def attach(self, env: RoboIRGEnv) -> None:
        """Get hold of the environment.

        Raises:
            InvalidValueError: it does not name pixels, and grounded subgoals are wanted.
        """
        if self.grounded and not env.grounded:
            raise InvalidValueError(
                "The oracle planner names pixels, but the environment does not know them; make "
                "it with grounded=True, or have subgoals=simple."
            )
        self._env = env

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Nothing is to be remembered."""

    def plan(self, observation: Observation, step: int) -> str:  # noqa: ARG002
        """The stage that is due, in words."""
        if self._env is None:
            raise RuntimeError("OraclePlanner needs attach(env) before plan().")
        return self._env.subgoal
