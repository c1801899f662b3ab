// How the process keeps the memory of the host.
#pragma once

namespace pictura {

/// From then on memory that is freed stays with the process for what is allocated next, large blocks too, instead of
/// being mapped anew, page by page and zeroed by the kernel, for each tensor. Of the whole process; does nothing where
/// the C library is not glibc.
void keep_freed_memory();

}  // namespace pictura
