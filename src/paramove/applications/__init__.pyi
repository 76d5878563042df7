from .options import RelocatorOptions as RelocatorOptions
from .options import RuleLearnerOptions as RuleLearnerOptions
from .reach_task import ReachStep as ReachStep
from .reach_task import ReachTask as ReachTask
from .relocator import Relocator as Relocator
from .rule_learner import RuleLearner as RuleLearner
from .turns import Turns as Turns
