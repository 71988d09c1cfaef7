"""What a run shows beside its records: what has arrived at the control station, and lines that tell the story."""

from __future__ import annotations

from teleop_sim.channel.messages import HandCloud, Image, VoxelCloud, WebpImage
from teleop_sim.channel.picture_messages import Picture
from teleop_sim.core.records import Record
from teleop_sim.core.views import WORLD, CameraPicture, CloudShown, Lens, Show
from teleop_sim.log.foxglove_lines import line_of
from teleop_sim.robot.perception.camera import focal_px
from teleop_sim.world.shapes import CAMERA

_MEDIA: dict[bytes, tuple[type[Picture], str]] = {Image.marks: (Image, "jpeg"), WebpImage.marks: (WebpImage, "webp")}


class Onlooker:
    """Turns payloads and records into views.

    Args:
        show: where they go.
    """

    def __init__(self, show: Show) -> None:
        self._show = show
        self._size_px = (0, 0)

    def told(self, record: Record) -> None:
        """Show the line of a record, if it has one."""
        line = line_of(record)
        if line is not None:
            self._show(line)

    def arrived(self, payload: bytes, t_s: float) -> None:
        """Show what the downlink has delivered, if there is something to see in it; decoded from its bytes."""
        mark = payload[:1]
        if mark in _MEDIA:
            kind, media = _MEDIA[mark]
            self._picture(kind.decode(payload), media, t_s)
        elif mark == VoxelCloud.marks:
            self._cloud(VoxelCloud.decode(payload), t_s)
        elif mark == HandCloud.marks:
            self._cloud(HandCloud.decode(payload).voxels, t_s)

    def _picture(self, picture: Picture, media: str, t_s: float) -> None:
        size_px = picture.width, picture.height
        if size_px != self._size_px:
            # The field of view stays: what the believed camera has for a picture of this width.
            self._size_px = size_px
            self._show(Lens(t_s, CAMERA, *size_px, focal_px(picture.width)))
        self._show(CameraPicture(t_s, CAMERA, media, picture.coded))

    def _cloud(self, cloud: VoxelCloud, t_s: float) -> None:
        self._show(CloudShown(t_s, WORLD, cloud.centres_m().astype("<f4").tobytes()))
