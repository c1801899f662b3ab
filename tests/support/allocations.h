// Counts the allocations of a thread. Linking allocations.cpp replaces a binary's operator new.
#pragma once

namespace pictura::test {

/// Allocations of the calling thread so far.
long allocations();

}  // namespace pictura::test
