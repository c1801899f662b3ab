#include "pictura/apps/command.h"

int main(int argc, char** argv) { return pictura::run_command(argc, argv); }
