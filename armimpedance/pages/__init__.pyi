from .asked import Asked as Asked
from .choice import write_choice as write_choice
from .door import report_page as report_page
from .rendering import write_page as write_page
from .topic import TOPICS as TOPICS
