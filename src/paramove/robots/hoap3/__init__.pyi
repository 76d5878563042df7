from .firmware import Firmware as Firmware
