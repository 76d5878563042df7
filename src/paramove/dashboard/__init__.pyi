from .link_file import NAME as NAME
from .link_file import link_in as link_in
from .live_picture import LivePicture as LivePicture
from .live_picture import Texts as Texts
from .live_picture import subscribe_to_nodes as subscribe_to_nodes
from .server import PageServer as PageServer
from .set_up_page import SetUpPage as SetUpPage
from .stop_button import StopButton as StopButton
