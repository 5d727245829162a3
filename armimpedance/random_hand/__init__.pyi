from .identify import identify_random as identify_random
from .lines import Lines as Lines, lines_of as lines_of
from .response import ResponseMatrix as ResponseMatrix, response_matrix as response_matrix
from .result import RandomFit as RandomFit, ReflexPart as ReflexPart
