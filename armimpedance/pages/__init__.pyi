from .choice import write_choice as write_choice
from .explore.write import write_explore as write_explore
from .report import write_report as write_report
from .topic import TOPICS as TOPICS
