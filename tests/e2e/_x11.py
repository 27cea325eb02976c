"""What other programs say to a window of X11, by Xlib itself: xdotool knows keys and buttons only."""
import ctypes
import time
from ctypes import c_char, c_char_p, c_int, c_long, c_ulong, c_void_p


class ClientMessage(ctypes.Structure):
    _fields_ = [("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("window", c_ulong), ("message_type", c_ulong),
                ("format", c_int), ("data", c_long * 5)]


class SelectionRequest(ctypes.Structure):
    _fields_ = [("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("owner", c_ulong), ("requestor", c_ulong),
                ("selection", c_ulong), ("target", c_ulong), ("property", c_ulong), ("time", c_ulong)]


class Selection(ctypes.Structure):
    _fields_ = [("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p), ("requestor", c_ulong), ("selection", c_ulong),
                ("target", c_ulong), ("property", c_ulong), ("time", c_ulong)]


class Event(ctypes.Union):
    _fields_ = [("type", c_int), ("message", ClientMessage), ("request", SelectionRequest), ("selection", Selection), ("room", c_char * 192)]


SELECTION_REQUEST, SELECTION_NOTIFY, CLIENT_MESSAGE = 30, 31, 33


class Display:
    def __init__(self):
        self.x = ctypes.CDLL("libX11.so.6")
        for function, result, arguments in (
                ("XOpenDisplay", c_void_p, [c_char_p]), ("XCloseDisplay", c_int, [c_void_p]), ("XFlush", c_int, [c_void_p]), ("XPending", c_int, [c_void_p]),
                ("XInternAtom", c_ulong, [c_void_p, c_char_p, c_int]), ("XDefaultRootWindow", c_ulong, [c_void_p]),
                ("XCreateSimpleWindow", c_ulong, [c_void_p, c_ulong, c_int, c_int, c_int, c_int, c_int, c_ulong, c_ulong]),
                ("XSetSelectionOwner", c_int, [c_void_p, c_ulong, c_ulong, c_ulong]), ("XNextEvent", c_int, [c_void_p, c_void_p]),
                ("XSendEvent", c_int, [c_void_p, c_ulong, c_int, c_long, c_void_p]),
                ("XChangeProperty", c_int, [c_void_p, c_ulong, c_ulong, c_ulong, c_int, c_int, c_char_p, c_int])):
            getattr(self.x, function).restype, getattr(self.x, function).argtypes = result, arguments
        self.display = self.x.XOpenDisplay(None)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.x.XCloseDisplay(self.display)

    def atom(self, name):
        return self.x.XInternAtom(self.display, name.encode(), 0)

    def send(self, window, event):
        self.x.XSendEvent(self.display, window, 0, 0, ctypes.byref(event))
        self.x.XFlush(self.display)

    def tell(self, window, kind, *data):
        event = Event(message=ClientMessage(type=CLIENT_MESSAGE, display=self.display, window=window, message_type=self.atom(kind), format=32))
        event.message.data[:len(data)] = data
        self.send(window, event)

    def events(self, seconds):
        """Those that come within that time."""
        end, event = time.monotonic() + seconds, Event()
        while time.monotonic() < end:
            if self.x.XPending(self.display):
                self.x.XNextEvent(self.display, ctypes.byref(event))
                yield event
            else:
                time.sleep(0.01)


def ask_to_close(window):
    """What a window manager sends when the user presses a window's closing button (ICCCM 4.2.8.1)."""
    with Display() as display:
        display.tell(window, "WM_PROTOCOLS", display.atom("WM_DELETE_WINDOW"))


def drop_files(window, files, at, patience=60):
    """What a file manager does when the user drops files on a window, at a place of the screen (freedesktop.org: Drag-and-Drop Protocol for the X
    Window System, version 5)."""
    with Display() as display:
        x, handle = display.x, display.display
        source = x.XCreateSimpleWindow(handle, x.XDefaultRootWindow(handle), 0, 0, 1, 1, 0, 0, 0)
        selection, uris, copy = (display.atom(name) for name in ("XdndSelection", "text/uri-list", "XdndActionCopy"))
        x.XSetSelectionOwner(handle, selection, source, 0)
        status, finished = display.atom("XdndStatus"), display.atom("XdndFinished")
        text = "".join(f"{file.resolve().as_uri()}\r\n" for file in files).encode()
        display.tell(window, "XdndEnter", source, 5 << 24, uris)
        display.tell(window, "XdndPosition", source, 0, round(at[0]) << 16 | round(at[1]), 0, copy)
        for event in display.events(patience):
            if event.type == CLIENT_MESSAGE and event.message.message_type == status:
                assert event.message.data[1] & 1, "the window takes no files"
                display.tell(window, "XdndDrop", source, 0, 0)
            elif event.type == SELECTION_REQUEST:
                asked = event.request
                assert asked.selection == selection and asked.target == uris
                x.XChangeProperty(handle, asked.requestor, asked.property, asked.target, 8, 0, text, len(text))
                display.send(asked.requestor, Event(selection=Selection(type=SELECTION_NOTIFY, display=handle, requestor=asked.requestor, selection=asked.selection,
                                                                        target=asked.target, property=asked.property, time=asked.time)))
            elif event.type == CLIENT_MESSAGE and event.message.message_type == finished:
                return
        raise AssertionError(f"the window has not taken the files within {patience} s")
