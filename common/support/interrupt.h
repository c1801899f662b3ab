// ^C as a question that long work asks between its steps, instead of a sudden death.
#pragma once

namespace pictura {

/// From now on SIGINT and SIGTERM set a flag; a second one ends the process at once.
void catch_interrupts();

/// Whether one came. Never true unless catch_interrupts() was called.
bool interrupted();

}  // namespace pictura
