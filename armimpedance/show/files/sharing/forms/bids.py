"""A recording as a raw dataset of Motion-BIDS."""

from armimpedance.show.files.sharing.form import Form
from armimpedance.show.files.sharing.motion_dataset import write_motion_dataset

FORM = Form(
    what="a recording as a dataset of Motion-BIDS",
    write=write_motion_dataset,
    takes=("recording",),
)
