#include "records/results_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "base/error.h"

namespace relign::records {

ResultsLock::ResultsLock(const std::filesystem::path& folder, const std::string& file_name)
    : file_(folder / file_name) {
  while (true) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor_ < 0)
      throw Error(ErrorKind::io,
                  "cannot write into the results folder '" + folder.string() + "': " + std::strerror(errno));
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      const int reason = errno;
      if (reason == EWOULDBLOCK) {
        ::close(descriptor_);
        throw FolderInUse("another run is writing " + folder.string() +
                          "; wait until it has ended or choose another folder with --out");
      }
      // A file system without locks (some network mounts): continue without one.
      if (reason != EINTR) return;
    } else {
      // The previous owner may have removed the file between our open and our lock: then other processes do not see
      // the locked file, and we try again.
      struct stat mine {};
      struct stat there {};
      if (::fstat(descriptor_, &mine) == 0 && ::stat(file_.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
          mine.st_dev == there.st_dev) {
        held_ = true;
        return;
      }
    }
    ::close(descriptor_);
  }
}

ResultsLock::~ResultsLock() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

}  // namespace relign::records
