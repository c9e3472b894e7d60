"""PETSc's binary files, big-endian: class id, sizes, lengths of rows and columns as integers of 4 bytes, or of 8 by a PETSc with 64-bit indices."""
import numpy as np
import scipy.sparse

MATRIX, VECTOR = 1211216, 1211214


def read_matrix(data):
    """A sparse matrix of a file's bytes as a dense one."""
    wide = 4 if np.frombuffer(data, ">i4", 1)[0] == MATRIX else 8
    head = np.frombuffer(data, f">i{wide}", 4)
    assert head[0] == MATRIX, head
    _, rows, columns, count = (int(number) for number in head)
    lengths = np.frombuffer(data, f">i{wide}", rows, 4 * wide)
    at = np.frombuffer(data, f">i{wide}", count, (4 + rows) * wide)
    A = np.zeros((rows, columns))
    A[np.repeat(np.arange(rows), lengths), at] = np.frombuffer(data, ">f8", count, (4 + rows + count) * wide)
    return A


def write(path, matrix, wide=4):
    """A matrix or vector with integers of so many bytes."""
    integers = f">i{wide}"
    with open(path, "wb") as f:
        if np.ndim(matrix) == 1:
            np.array([VECTOR, len(matrix)], integers).tofile(f)
            np.asarray(matrix, ">f8").tofile(f)
        else:
            m = scipy.sparse.csr_matrix(matrix)
            np.array([MATRIX, *m.shape, m.nnz], integers).tofile(f)
            np.diff(m.indptr).astype(integers).tofile(f)
            m.indices.astype(integers).tofile(f)
            m.data.astype(">f8").tofile(f)
