"""Makes run files of a whole one with HDF5 itself: `foreign_runs.py RUN.h5 FOLDER`: what nobody should declare, link or
store; then 500 copies with bytes changed anywhere."""
import os
import random
import shutil
import sys

import h5py
import numpy as np

source, folder = sys.argv[1:]
os.mkfifo(f"{folder}/pipe")
count = 0


def crafted(name, change):
    global count
    path = f"{folder}/crafted_{count:02d}_{name}.h5"
    shutil.copy(source, path)
    os.chmod(path, 0o644)
    with h5py.File(path, "r+") as file:
        change(file)
    count += 1


with h5py.File(source) as whole:
    groups = list(whole)
    tables = []
    whole.visititems(lambda name, found: tables.append(name) if isinstance(found, h5py.Dataset) else None)


def again(file, name, shape, **how):
    """The table of this name with other rows, and the attributes that it had."""
    attributes = dict(file[name].attrs)
    del file[name]
    table = file.create_dataset(name, shape=shape, maxshape=(None,) + shape[1:], **how)
    for key, value in attributes.items():
        table.attrs[key] = value
    return table


def declared(rows, name, **how):
    def change(file):
        old = file[name]
        again(file, name, (rows,) + old.shape[1:], dtype=old.dtype, chunks=old.chunks, **how)
    return change


def linked(name, to):
    def change(file):
        del file[name]
        file[name] = to
    return change


def lying_elsewhere(other, size):
    def change(file):
        del file["load_cell/t_arrival_ns"]
        file.create_dataset("load_cell/t_arrival_ns", shape=(size // 8,), dtype="i8", external=[(other, 0, size)])
    return change


def virtual(file):
    del file["load_cell/t_arrival_ns"]
    layout = h5py.VirtualLayout(shape=(10**6,), dtype="i8")
    layout[:] = h5py.VirtualSource(f"{folder}/pipe", "x", shape=(10**6,))
    file.create_virtual_dataset("load_cell/t_arrival_ns", layout)


def zeros_packed(file):
    table = again(file, "load_cell/t_arrival_ns", (2 * 10**7,), dtype="i8", chunks=(10**6,), compression="gzip")
    for begin in range(0, 2 * 10**7, 10**6):
        table[begin:begin + 10**6] = 0


def nested(file):
    for _ in range(300):
        file = file.create_group("g")


def replaced(name, value):
    def change(file):
        del file[name]
        file[name] = value
    return change


for rows in (10**7, 10**8, 10**9, 2**40, 2**60):
    for name in (tables[0], tables[len(tables) // 2], tables[-1]):
        crafted("rows", declared(rows, name))
for name in tables[:4]:
    crafted("packed_rows", declared(10**8, name, compression="gzip"))
crafted("zeros_packed", zeros_packed)
for name in groups:
    crafted("external_link", linked(name, h5py.ExternalLink(f"{folder}/pipe", "/")))
    crafted("soft_link", linked(name, h5py.SoftLink("/")))
for name in tables[:4]:
    crafted("soft_link", linked(name, h5py.SoftLink("/" + tables[-1])))
for other, size in (("/etc/passwd", 800), ("/dev/zero", 8 * 10**7), (f"{folder}/pipe", 800)):
    crafted("external_storage", lying_elsewhere(other, size))
crafted("virtual", virtual)
for kind in ("f4", "i1", "S10", ">i8", h5py.string_dtype(), np.dtype([("a", "i4")])):
    crafted("type", lambda file: again(file, tables[0], (100,), dtype=kind, chunks=True))
crafted("rank", lambda file: again(file, tables[0], (2, 2, 2, 2, 2), dtype="i8", chunks=True))
crafted("scalar", replaced(tables[0], 5))
crafted("table_for_group", replaced(groups[0], [1]))
crafted("group_for_table", lambda file: (file.pop(tables[0]), file.create_group(tables[0])))
crafted("long_attribute", lambda file: file.attrs.create("campaign_name", "x" * 60000))
crafted("escapes", lambda file: file.attrs.create("outcome_reason", "\x1b[31m" * 1000))
crafted("attribute_of_many", lambda file: file.attrs.create("complete", np.zeros(1000)))
crafted("attribute_of_text", lambda file: file.attrs.create("complete", "yes"))
crafted("cycle", lambda file: file.create_group("a").__setitem__("b", file["/"]))
crafted("nested", nested)
for rows in (10**8, 2**60):
    crafted("n_valid", lambda file: [file[name].attrs.create("n_valid", rows, dtype="u8") for name in groups])
crafted("large_chunk", lambda file: again(file, tables[0], (10,), dtype="i8", chunks=(3 * 10**8,)))
crafted("fill_value", declared(10**8, tables[0], fillvalue=7))
for name, bytes_ in (("nothing", b""), ("signature", b"\x89HDF\r\n\x1a\n"), ("zeros", bytes(10**6))):
    crafted(name, lambda file: None)
    with open(f"{folder}/crafted_{count - 1:02d}_{name}.h5", "wb") as file:
        file.write(bytes_)

seeded = random.Random(43)
with open(source, "rb") as file:
    whole_bytes = file.read()
for number in range(500):
    data = bytearray(whole_bytes)
    for _ in range(seeded.choice([1, 1, 2, 4, 16, 64])):
        size = len(data)
        begin, end = seeded.choice([(0, min(65536, size)), (max(0, size - 65536), size), (0, size)])
        at = seeded.randrange(begin, end)
        how = seeded.randrange(5)
        if how == 0:
            data[at] ^= 1 << seeded.randrange(8)
        elif how == 1:
            data[at:at + 8] = b"\xff" * 8
        elif how == 2:
            data[at:at + 8] = bytes(8)
        elif how == 3:
            data[at:at + 8] = seeded.randrange(2 ** seeded.randrange(1, 63)).to_bytes(8, "little")
        elif seeded.random() < 0.1:
            data = data[:at + 1]
    with open(f"{folder}/mutated_{number:03d}.h5", "wb") as file:
        file.write(data)
