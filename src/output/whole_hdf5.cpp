#include "output/whole_hdf5.hpp"
#include "output/fresh_file.hpp"

namespace bs {

PetscErrorCode write_whole_hdf5(MPI_Comm comm, const std::string& target, std::int64_t bytes, const std::function<PetscErrorCode(hid_t)>& fill,
                                std::string* made, std::string* reason) {
  FileIdentity identity;
  PetscFunctionBegin;
  PetscCall(create_fresh_hdf5(comm, target, made, &identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  BS_H5(H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL));
  H5 file(H5Fopen(made->c_str(), H5F_ACC_RDWR, access), H5Fclose);
  BS_H5(file);
  PetscCall(confirm_identity(comm, *made, identity, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  PetscCall(reserve_space(comm, *made, -1, bytes, reason));
  if (!reason->empty()) PetscFunctionReturn(0);
  PetscCall(fill(file));
  BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
  PetscFunctionReturn(0);
}

}  // namespace bs
