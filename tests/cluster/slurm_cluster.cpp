#include "slurm_cluster.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <set>
#include <thread>

namespace relign::cluster_test {
namespace {

namespace fs = std::filesystem;

void pause_briefly() { std::this_thread::sleep_for(std::chrono::milliseconds(100)); }

std::string find_program(const std::string& name) {
  for (const char* folder : {"/usr/sbin", "/usr/bin", "/sbin", "/usr/local/sbin"})
    if (::access((fs::path(folder) / name).c_str(), X_OK) == 0) return (fs::path(folder) / name).string();
  return "";
}

std::vector<int> free_ports(int count) {
  std::vector<int> sockets, ports;
  for (int i = 0; i < count; ++i) {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    ::bind(socket, reinterpret_cast<sockaddr*>(&address), size);
    ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
    sockets.push_back(socket);
    ports.push_back(ntohs(address.sin_port));
  }
  for (const int socket : sockets) ::close(socket);
  return ports;
}

// cred_expire: how long a requeued job waits before it may start again (120 s by default).
std::string configuration(const fs::path& folder) {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  const std::string short_host = std::string(host).substr(0, std::string(host).find('.'));
  const passwd* user = ::getpwuid(::geteuid());
  const std::string name = user != nullptr ? user->pw_name : "root";
  const std::vector<int> ports = free_ports(3);
  const std::string at = folder.string();
  return "ClusterName=lab\nSlurmctldHost=" + short_host + "(127.0.0.1)\nSlurmctldPort=" + std::to_string(ports[0]) +
         "\nSlurmUser=" + name + "\nSlurmdUser=" + name +
         "\nAuthType=auth/none\nCredType=cred/none\nAuthInfo=cred_expire=3\nStateSaveLocation=" + at +
         "/state\nSlurmdSpoolDir=" + at + "/spool/%n\nSlurmctldPidFile=" + at + "/ctld.pid\nSlurmdPidFile=" + at +
         "/%n.pid\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSelectType=select/cons_tres\n"
         "SelectTypeParameters=CR_Core\nMpiDefault=none\nReturnToService=2\nSlurmdTimeout=120\n"
         "SlurmdParameters=config_overrides\nSchedulerParameters=bf_interval=1\nNodeName=n[1-2] NodeHostname=" +
         short_host + " NodeAddr=127.0.0.1 Port=" + std::to_string(ports[1]) + "," + std::to_string(ports[2]) +
         " CPUs=8 State=UNKNOWN\nPartitionName=debug Nodes=ALL Default=YES MaxTime=60 State=UP\n";
}

std::string last_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line, last;
  while (std::getline(stream, line))
    if (!line.empty()) last = line;
  return last;
}

void end(pid_t process) { ::kill(process, SIGKILL); }

}  // namespace

std::vector<Process> descendants() {
  std::vector<Process> all;
  std::error_code code;
  for (fs::directory_iterator entry("/proc", code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry->path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t closing = text.rfind(')');
    if (closing == std::string::npos || closing + 4 > text.size() || text[closing + 2] == 'Z') continue;
    Process process;
    process.id = std::stoi(name);
    process.parent = std::stoi(text.substr(closing + 4));
    std::ifstream words(entry->path() / "cmdline");
    process.command.assign(std::istreambuf_iterator<char>(words), {});
    std::replace(process.command.begin(), process.command.end(), '\0', ' ');
    all.push_back(process);
  }
  std::set<pid_t> known = {::getpid()};
  std::vector<Process> found;
  for (bool grown = true; grown;) {
    grown = false;
    for (const Process& process : all) {
      if (known.count(process.parent) == 0 || !known.insert(process.id).second) continue;
      found.push_back(process);
      grown = true;
    }
  }
  return found;
}

SlurmCluster::SlurmCluster() {
  controller_program_ = find_program("slurmctld");
  node_program_ = find_program("slurmd");
  if (controller_program_.empty() || node_program_.empty() || find_program("sbatch").empty()) {
    problem_ = "slurmctld, slurmd or sbatch is not installed (package slurm-wlm)";
    return;
  }
  // What a daemon leaves behind becomes our child and is ended with us.
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  for (const char* folder : {"state", "spool/n1", "spool/n2"}) fs::create_directories(place_.path(folder));
  config_ = place_.path("slurm.conf").string();
  place_.write("slurm.conf", configuration(place_.folder()));
  options_.environment["SLURM_CONF"] = config_;
  controller_ =
      std::make_unique<cli_test::Running>(place_,
                                          std::vector<std::string>{controller_program_, "-D", "-c", "-f", config_, "-L",
                                                                   place_.path("controller.log").string()},
                                          options_);
  first_ = std::make_unique<cli_test::Running>(
      place_,
      std::vector<std::string>{node_program_, "-D", "-N", "n1", "-f", config_, "-L", place_.path("n1.log").string()},
      options_);
  second_ = std::make_unique<cli_test::Running>(
      place_,
      std::vector<std::string>{node_program_, "-D", "-N", "n2", "-f", config_, "-L", place_.path("n2.log").string()},
      options_);
  wait_until_ready();
}

void SlurmCluster::wait_until_ready() {
  for (int round = 0; round < 200; ++round) {
    const cli_test::Outcome nodes = cli_test::shell(place_, "SLURM_CONF=" + config_ + " sinfo -h -N -o '%N %T'");
    if (nodes.out == "n1 idle\nn2 idle\n") return;
    if (controller_->ended() || first_->ended() || second_->ended()) break;
    pause_briefly();
  }
  problem_ = "Slurm does not run here; its logs end with: " + last_line(place_.path("controller.log")) + " | " +
             last_line(place_.path("n1.log"));
}

SlurmCluster::~SlurmCluster() {
  for (int round = 0; round < 50; ++round) {
    const std::vector<Process> left = descendants();
    if (left.empty()) break;
    for (const Process& process : left) end(process.id);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  controller_.reset();
  first_.reset();
  second_.reset();
  while (::waitpid(-1, nullptr, WNOHANG) > 0) {
  }
}

void SlurmCluster::lose_node(const std::string& node, const std::vector<std::string>& job_ids) {
  (node == "n1" ? first_ : second_).reset();
  for (const Process& process : descendants())
    for (const std::string& job : job_ids)
      if (process.command.rfind("slurmstepd: [" + job + ".", 0) == 0) end(process.id);
  cli_test::shell(place_, "SLURM_CONF=" + config_ + " scontrol update nodename=" + node + " state=down reason=lost");
}

}  // namespace relign::cluster_test
