"""Writes synthetic.AT2 beside this file: filtered noise below an envelope, no recording of an earthquake.

White noise (numpy's PCG64, seed 20) is given the spectrum of Kanai and Tajimi for firm ground (15.6 rad/s, damping
0.6), its long periods are removed by the filter of Clough and Penzien (1.5 rad/s, 0.6), and the envelope of Jennings,
Housner and Tsai shapes it: it rises with (t/t1)^2 to t1 = 2 s, is 1 until t2 = 8 s and falls with exp(-0.3 (t - t2)).
20 s at 0.005 s, 0.35 g.

K. Kanai, Bull. Earthq. Res. Inst. 35 (1957) 309; H. Tajimi, Proc. 2nd World Conf. Earthq. Eng. (1960) 781; R. W. Clough
and J. Penzien, Dynamics of Structures (1975); P. C. Jennings, G. W. Housner, N. C. Tsai, Simulated earthquake motions
(Caltech, 1968).

    python scenarios/records/synthetic.py
"""  # noqa: INP001 - a script beside what it writes

from pathlib import Path

import numpy as np

COUNT, STEP, SEED, PGA = 4001, 0.005, 20, 0.35  # samples, s, -, g
GROUND, LONG = (15.6, 0.6), (1.5, 0.6)  # rad/s and damping of the filters
RISEN, FALLS, DECAY = 2.0, 8.0, 0.3  # s, s, 1/s, of the envelope
HEAD = """\
blocksim: SYNTHETIC record, not an earthquake
Kanai-Tajimi and Clough-Penzien noise, Jennings envelope, seed {seed}; made by synthetic.py
ACCELERATION TIME SERIES IN UNITS OF G
NPTS={count:6d}, DT= {step:.4f} SEC
"""


def record() -> np.ndarray:
    """Return the accelerations in g."""
    noise = np.fft.rfft(np.random.default_rng(SEED).standard_normal(2 * COUNT))
    w = 2.0 * np.pi * np.fft.rfftfreq(2 * COUNT, STEP)
    ground, long = (one**2 - w**2 + 2j * damping * one * w for one, damping in (GROUND, LONG))
    passed = (GROUND[0] ** 2 + 2j * GROUND[1] * GROUND[0] * w) / ground * -(w**2) / long
    t = STEP * np.arange(COUNT)
    envelope = np.minimum(1.0, (t / RISEN) ** 2) * np.exp(-DECAY * np.maximum(0.0, t - FALLS))
    shaped = envelope * np.fft.irfft(noise * passed)[:COUNT]
    return PGA / np.abs(shaped).max() * shaped


if __name__ == "__main__":
    text = HEAD.format(seed=SEED, count=COUNT, step=STEP)
    values = [f"{value:15.7E}" for value in record()]
    lines = ["".join(values[place : place + 5]) for place in range(0, COUNT, 5)]
    Path(__file__).with_name("synthetic.AT2").write_text(text + "\n".join(lines) + "\n")
