from .kinarm.overview_text import ExamLook as ExamLook, look_at_exam as look_at_exam
from .mapped.door import propose_mapping as propose_mapping
from .mapped.held import recording as recording
from .motion.skeleton_json import read_skeleton as read_skeleton
from .opening import (
    FOLDER_FILES as FOLDER_FILES,
    is_recording as is_recording,
    open_recording as open_recording,
    read_subject as read_subject,
    write_recording as write_recording,
)
from .reading import AnyRecording as AnyRecording, ReadOptions as ReadOptions
from .where import with_where as with_where
