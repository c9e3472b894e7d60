"""What a program opens or makes in a folder, as the kernel tells it (inotify): the program itself is not asked."""
import ctypes
import os
import struct

libc = ctypes.CDLL(None, use_errno=True)
OPENED, MODIFIED, MOVED_TO, CREATED, DELETED = 0x20, 0x2, 0x80, 0x100, 0x200


class Watch:
    """with Watch(folder) as watch: ...; watch.names(): the files of the folder that were opened, made, changed or removed."""

    def __init__(self, folder):
        self.handle = libc.inotify_init1(os.O_NONBLOCK)
        if self.handle < 0 or libc.inotify_add_watch(self.handle, os.fsencode(str(folder)), OPENED | MODIFIED | MOVED_TO | CREATED | DELETED) < 0:
            raise OSError(ctypes.get_errno(), "inotify")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.handle)

    def names(self):
        found = set()
        while True:
            try:
                data = os.read(self.handle, 1 << 16)
            except BlockingIOError:
                return found
            at = 0
            while at < len(data):
                _, _, _, length = struct.unpack_from("iIII", data, at)
                found.add(data[at + 16:at + 16 + length].rstrip(b"\0").decode(errors="replace"))
                at += 16 + length
