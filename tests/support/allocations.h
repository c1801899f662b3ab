// Counter of a thread's allocations. Programs link allocations.cpp for its operator new.
#pragma once

namespace pictura::test {

long allocations();

}  // namespace pictura::test
