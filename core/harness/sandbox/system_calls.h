// The system calls that a process in a sandbox may make (seccomp). Its name spaces hide files, processes and networks;
// this closes what they leave: tracing, kernel keys, locks and notices on shared files, new name spaces, sockets other
// than local ones, and interfaces with a long record of kernel faults.
#pragma once

namespace relign::sandbox {

// For this thread and what it starts. Ends the program when the kernel has no filters.
void filter_system_calls();

}  // namespace relign::sandbox
