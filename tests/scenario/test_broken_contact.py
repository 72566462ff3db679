"""Contact models, laws and their numbers that do not go together. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

CASES = {
    "misspelt contact model": (
        '\n[contact]\nmodel = "kernels"\n',
        """
bad.toml:21: contact.model: "kernels" is unknown, did you mean "kernel"?
   21 | model = "kernels"
      |         ^^^^^^^^^
""",
    ),
    "unknown kernel function": (
        '\n[contact]\nkernel = "gauss"\n',
        """
bad.toml:21: contact.kernel: "gauss" is unknown, use "wendland-c2" or "cubic-spline" or "quintic-spline"
   21 | kernel = "gauss"
      |          ^^^^^^^
""",
    ),
    "fixed stiffness with Hertz": (
        '\n[contact]\nlaw = "hertz-mindlin"\nnormal_stiffness = "1 MN/m"\n',
        """
bad.toml:22: contact.normal_stiffness: law "hertz-mindlin" takes it from the materials and contact_radius; use stiffness_scale
   22 | normal_stiffness = "1 MN/m"
      |                    ^^^^^^^^
""",
    ),
    "fixed stiffness of a pair with Hertz": (
        '\n[contact]\nlaw = "hertz-mindlin"\n\n[pairs.steel.ground]\nnormal_stiffness = "1 MN/m"\n',
        """
bad.toml:24: pairs.steel.ground.normal_stiffness: law "hertz-mindlin" takes it from the materials and contact_radius; use stiffness_scale
   24 | normal_stiffness = "1 MN/m"
      |                    ^^^^^^^^
""",
    ),
    "contact radius of zero": (
        "\n[contact]\ncontact_radius = 0\n",
        """
bad.toml:21: contact.contact_radius: 0 is too small; a length above 0 such as "32 mm" is needed
   21 | contact_radius = 0
      |                  ^
""",
    ),
    "skin of zero": (
        "\n[contact]\nskin = 0\n",
        """
bad.toml:21: contact.skin: 0 is too small; a length above 0 such as "32 mm" is needed
   21 | skin = 0
      |        ^
""",
    ),
    "negative skin": (
        '\n[contact]\nskin = "-1 mm"\n',
        """
bad.toml:21: contact.skin: "-1 mm" is too small; a length above 0 such as "32 mm" is needed
   21 | skin = "-1 mm"
      |        ^^^^^^^
""",
    ),
    "skin that is not a number": (
        "\n[contact]\nskin = nan\n",
        """
bad.toml:21: contact.skin: nan is not a finite number; a length above 0 such as "32 mm" is needed
   21 | skin = nan
      |        ^^^
""",
    ),
    "endless skin": (
        "\n[contact]\nskin = inf\n",
        """
bad.toml:21: contact.skin: inf is not a finite number; a length above 0 such as "32 mm" is needed
   21 | skin = inf
      |        ^^^
""",
    ),
    "skin that is a time": (
        '\n[contact]\nskin = "1 ms"\n',
        """
bad.toml:21: contact.skin: "1 ms" is a time; a length above 0 such as "32 mm" is needed
   21 | skin = "1 ms"
      |        ^^^^^^
""",
    ),
    "skin that is used up at every step": (
        '\n[contact]\nskin = "1.9 um"\n',
        """
bad.toml:21: contact.skin: 0.0019 mm is too small; at least 0.002 mm is needed, 0.01 % of the smallest side of a block
   21 | skin = "1.9 um"
      |        ^^^^^^^^
""",
    ),
    "skin lost in the round-off of positions far away": (
        '\n[contact]\nskin = "0.01 mm"\n\n[[bodies]]\nblock = "brick"\nx = -1e9\ny = 1\n',
        """
bad.toml:21: contact.skin: 0.01 mm is too small; at least 0.0119209 mm is needed, 100 times the round-off of positions 1e+09 m away
   21 | skin = "0.01 mm"
      |        ^^^^^^^^^
""",
    ),
    "skin beyond the smallest block": (
        '\n[contact]\nskin = "20.1 mm"\n',
        """
bad.toml:21: contact.skin: 20.1 mm is more than the smallest side of a block, 20 mm; distant blocks would be listed as neighbours
   21 | skin = "20.1 mm"
      |        ^^^^^^^^^
""",
    ),
    "smoothing length with no neighbours": (
        '\n[contact]\nmodel = "kernel"\nsmoothing_length = "0.79 mm"\n',
        """
bad.toml:22: contact.smoothing_length: 0.79 mm reaches too few particles; at least 0.8 particle_spacing (0.8 mm) is needed
   22 | smoothing_length = "0.79 mm"
      |                    ^^^^^^^^^
""",
    ),
    "smoothing length through a block": (
        '\n[contact]\nmodel = "kernel"\nsmoothing_length = "10 mm"\n',
        """
bad.toml:22: contact.smoothing_length: a wendland-c2 of smoothing length 10 mm reaches 20 mm, through the smallest side of a block, 20 mm
   22 | smoothing_length = "10 mm"
      |                    ^^^^^^^
""",
    ),
    "spacing whose kernel reaches through a block": (
        '\n[contact]\nmodel = "kernel"\nparticle_spacing = "7.7 mm"\n',
        """
bad.toml:22: contact.particle_spacing: a wendland-c2 of smoothing length 10.01 mm reaches 20.02 mm, through the smallest side of a block, 20 mm
   22 | particle_spacing = "7.7 mm"
      |                    ^^^^^^^^
""",
    ),
    "kernel of a longer reach": (
        '\n[contact]\nmodel = "kernel"\nkernel = "quintic-spline"\nparticle_spacing = "6 mm"\n',
        """
bad.toml:23: contact.particle_spacing: a quintic-spline of smoothing length 7.8 mm reaches 23.4 mm, through the smallest side of a block, 20 mm
   23 | particle_spacing = "6 mm"
      |                    ^^^^^^
""",
    ),
    "particles too far apart": (
        '\n[contact]\nmodel = "particles"\nparticle_spacing = "10.1 mm"\n',
        """
bad.toml:22: contact.particle_spacing: 10.1 mm is more than half of the smallest side of a block, 20 mm
   22 | particle_spacing = "10.1 mm"
      |                    ^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("new", "message"), CASES.values(), ids=CASES)
def test_contact(refusal_of_edit: Callable[[str | None, str], tuple[int, str]], new: str, message: str) -> None:
    assert refusal_of_edit(None, new) == (65, message.strip("\n"))


@pytest.mark.parametrize("model", ["particles", "kernel"])
@pytest.mark.parametrize("spacing", ["1e-300 m", "1 nm", "0.5 um"])
def test_particles_finer_than_a_side_can_have_are_refused(
    refusal_of_edit: Callable[..., tuple[int, str]], model: str, spacing: str
) -> None:  # they overflowed a field of 16 bits
    text = f'\n[contact]\nmodel = "{model}"\nparticle_spacing = "{spacing}"\n'
    code, message = refusal_of_edit(None, text)
    assert code == 65
    assert "contact.particle_spacing: " in message
    assert "is too small" in message
