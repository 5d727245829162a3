from .simulate import ALL as ALL, simulate_body as simulate_body
from .subject import body_subject as body_subject
from .truth import BodyTruth as BodyTruth
