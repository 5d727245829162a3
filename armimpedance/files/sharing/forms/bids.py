"""A recording as a raw dataset of Motion-BIDS."""

from armimpedance.files.sharing.form import Form
from armimpedance.files.sharing.motion_dataset import write_motion_dataset

FORM = Form(
    what="a recording as a dataset of Motion-BIDS",
    write=write_motion_dataset,
    takes=("recording",),
)
