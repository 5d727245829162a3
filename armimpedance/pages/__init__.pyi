from .choice import write_choice as write_choice
from .cohort.write import write_cohort as write_cohort
from .explore.write import write_explore as write_explore
from .report import write_report as write_report
from .topic import TOPICS as TOPICS
