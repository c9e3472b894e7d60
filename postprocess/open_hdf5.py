"""Opens trajectories: HDF5 files whose numbers are all in the file itself."""
import os
import time

os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")  # a run may be writing the file
import h5py  # noqa: E402

last_opened = ""  # the file that was opened last, for messages about damaged ones


class RunError(Exception):
    """A file that cannot be used; the text is one line that names it and says why."""


def first_line(error):
    return (str(error).splitlines() or [type(error).__name__])[0]


def open_hdf5(path):
    """The file, for reading. Raises RunError, also where numbers of it are in other files."""
    global last_opened
    last_opened = str(path)
    if not os.path.exists(path):
        raise RunError(f"{path}: no such file")
    if os.path.isdir(path):
        raise RunError(f"{path}: is a folder, expected a trajectory")
    if not os.access(path, os.R_OK):
        raise RunError(f"{path}: no permission to read it")
    if not h5py.is_hdf5(path):
        raise RunError(f"{path}: not an HDF5 file; expected a trajectory written with -bs_output")
    for attempt in range(3):  # a run that is writing may be met between two writes
        file = None
        try:
            file = h5py.File(path, "r")
            _refuse_elsewhere(path, file)
            return file
        except (RunError, OSError, KeyError, ValueError, RuntimeError, TypeError) as error:
            if file:
                file.close()
            if isinstance(error, RunError):
                raise
            reason = first_line(error)
        time.sleep(0.1 * attempt)
    raise RunError(f"{path}: cannot be opened, truncated or damaged perhaps ({reason})")


def _refuse_elsewhere(path, file):
    """A file of somebody else must not show what is in other files: no links to them, no external storage, no virtual datasets."""
    waiting, seen = [file["/"]], set()
    while waiting:
        group = waiting.pop()
        place = h5py.h5o.get_info(group.id).addr
        if place in seen:
            continue
        seen.add(place)
        for name in group:
            where = f"{group.name.rstrip('/')}/{name}"
            link = group.get(name, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise RunError(f"{path}: {where} is a link to another file ({link.filename}), which is not followed: copy what it names into the file")
            if not isinstance(link, h5py.HardLink):
                continue  # a path within the file, whose end is met on its own
            item = group[name]
            if isinstance(item, h5py.Group):
                waiting.append(item)
            elif isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
                kind = "in external storage" if item.external else "a virtual dataset"
                raise RunError(f"{path}: {where} is {kind}, its numbers may be in other files, which are not read: copy them into the file (h5repack)")
