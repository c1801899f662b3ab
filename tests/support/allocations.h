// Counter of a thread's allocations. Linking allocations.cpp replaces a binary's operator new.
#pragma once

namespace pictura::test {

/// Returns the number of the calling thread's allocations so far.
long allocations();

}  // namespace pictura::test
