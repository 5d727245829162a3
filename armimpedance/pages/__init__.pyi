from .asked import Asked as Asked
from .door import report_page as report_page
from .rendering import write_page as write_page
from .topic import TOPICS as TOPICS
