"""How many steps a compiled call may take, so that signals and limits are heard soon and progress is shown."""

CALL_SECONDS = 0.05
BODY_STEPS_AT_FIRST = 100_000  # ten milliseconds or so; particles and rigid contacts take longer
MOST_GROWTH = 4  # from one call to the next: the first steps of a scene may be quick, as nothing touches


class Pace:
    """Steps of a call, from what earlier calls took. It decides no bits, as those do not depend on where calls end."""

    def __init__(self, bodies: int) -> None:
        """Begin with few for so many bodies."""
        self.steps = max(1, BODY_STEPS_AT_FIRST // bodies)

    def learn(self, steps: int, seconds: float) -> None:
        """Take account of a call of so many steps and seconds."""
        if steps > 0:
            fitting = CALL_SECONDS * steps / max(seconds, 1e-9)
            self.steps = max(1, int(min(fitting, MOST_GROWTH * max(steps, self.steps))))
