// Counter of a thread's allocations. A program that links allocations.cpp gets its operator new.
#pragma once

namespace pictura::test {

/// Returns the number of the calling thread's allocations so far.
long allocations();

}  // namespace pictura::test
