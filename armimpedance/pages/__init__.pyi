from .choice import write_choice as write_choice
from .report import write_report as write_report
from .topic import TOPICS as TOPICS
