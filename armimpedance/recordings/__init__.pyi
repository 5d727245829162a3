from .kinarm.overview_text import look_at_exam as look_at_exam
from .mapped.proposing import propose_mapping as propose_mapping
from .motion.skeleton_json import read_skeleton as read_skeleton
from .opening import is_recording as is_recording, open_recording as open_recording
from .reading import AnyRecording as AnyRecording, ReadOptions as ReadOptions
from .subject import read_subject as read_subject
from .writing import FOLDER_FILES as FOLDER_FILES, write_recording as write_recording
