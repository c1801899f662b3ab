// Counts what the thread allocates. A binary that links allocations.cpp has its operator new replaced.
#pragma once

namespace pictura::test {

/// Allocations of the calling thread so far.
long allocations();

}  // namespace pictura::test
