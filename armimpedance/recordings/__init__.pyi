from .kind import is_moving as is_moving, recording_kind as recording_kind
from .motion.marker_folder import read_markers as read_markers
from .motion.motion_capture import open_motion_capture as open_motion_capture
from .motion.motion_folder import read_motion as read_motion
from .motion.skeleton_json import read_skeleton as read_skeleton
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
from .writing import FOLDER_FILES as FOLDER_FILES, write_recording as write_recording
