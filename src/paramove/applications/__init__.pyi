from .reach_task import ReachStep as ReachStep
from .reach_task import ReachTask as ReachTask
from .relocator import Relocator as Relocator
from .relocator_options import RelocatorOptions as RelocatorOptions
from .rule_learner import RuleLearner as RuleLearner
from .stage import RuleLearnerOptions as RuleLearnerOptions
