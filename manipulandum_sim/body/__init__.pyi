from .simulate import ALL as ALL, simulate_body as simulate_body
from .truth import BodyTruth as BodyTruth
