"""Pictures, animations, reports. Importing this room is cheap: matplotlib is loaded when the first picture is drawn."""

from blocksim.view.strip import draw_strip

__all__ = ["draw_strip"]
