from .kind import is_moving as is_moving, recording_kind as recording_kind
from .motion.marker_folder import read_markers as read_markers, write_markers as write_markers
from .motion.motion_capture import open_motion_capture as open_motion_capture
from .motion.motion_folder import read_motion as read_motion, write_motion as write_motion
from .motion.moving_folder import EMG_FILES as EMG_FILES
from .motion.skeleton_json import SKELETON_FILE as SKELETON_FILE, read_skeleton as read_skeleton
from .opening import open_recording as open_recording
from .reading import (
    AnyRecording as AnyRecording,
    ReadOptions as ReadOptions,
    RecordedSubject as RecordedSubject,
)
from .subject import read_subject as read_subject
from .tables.folder import read_folder as read_folder, write_folder as write_folder
from .tables.metadata import (
    Metadata as Metadata,
    read_metadata as read_metadata,
)
