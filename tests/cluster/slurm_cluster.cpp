#include "slurm_cluster.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pwd.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

namespace relign::cluster_test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

Clock::duration waited = {};

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

// cred_expire: delay before a requeued job may start again, 120 s by default; Slurm 22.05 replaces values below 5 by
// the default. The scheduler checks waiting jobs every second instead of every minute.
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
         "\nAuthType=auth/none\nCredType=cred/none\nAuthInfo=cred_expire=5\nStateSaveLocation=" + at +
         "/state\nSlurmdSpoolDir=" + at + "/spool/%n\nSlurmctldPidFile=" + at + "/ctld.pid\nSlurmdPidFile=" + at +
         "/%n.pid\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSelectType=select/cons_tres\n"
         "SelectTypeParameters=CR_Core\nMpiDefault=none\nReturnToService=2\nSlurmdTimeout=120\n"
         "SlurmdParameters=config_overrides\n"
         "SchedulerParameters=bf_interval=1,sched_interval=1,sched_min_interval=0\nNodeName=n[1-2] NodeHostname=" +
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

}  // namespace

bool waited_too_long() { return waited > std::chrono::seconds(400); }

bool wait_for(const std::function<bool()>& holds) {
  const Clock::time_point begin = Clock::now();
  const Clock::duration before = waited;
  bool so = holds();
  while (!so && !waited_too_long() && Clock::now() - begin < std::chrono::seconds(120)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    so = holds();
    waited = before + (Clock::now() - begin);
  }
  return so;
}

SlurmCluster::SlurmCluster() {
  const std::string controller_program = find_program("slurmctld");
  node_program_ = find_program("slurmd");
  if (controller_program.empty() || node_program_.empty() || find_program("sbatch").empty()) {
    problem_ = "slurmctld, slurmd or sbatch is not installed (package slurm-wlm)";
    return;
  }
  for (const char* folder : {"state", "spool/n1", "spool/n2"}) fs::create_directories(place_.path(folder));
  config_ = place_.path("slurm.conf").string();
  place_.write("slurm.conf", configuration(place_.folder()));
  const pid_t controller = start(controller_program, "controller.log", {"-c"});
  for (const char* node : {"n1", "n2"}) return_node(node);
  bool ended = false;
  const bool ready = wait_for([&] {
    ended = !keeper_.alive(controller) || !keeper_.alive(nodes_["n1"]) || !keeper_.alive(nodes_["n2"]);
    return ended || said("sinfo -h -N -o '%N %T'") == "n1 idle\nn2 idle\n";
  });
  if (ended || !ready)
    problem_ =
        "Slurm does not run on this machine; last lines of its logs: " + last_line(place_.path("controller.log")) +
        " | " + last_line(place_.path("n1.log"));
}

cli_test::Outcome SlurmCluster::shell(const cli_test::Workplace& place, const std::string& script) const {
  return cli_test::shell(place, "export SLURM_CONF='" + config_ + "'; " + script);
}

pid_t SlurmCluster::start(const std::string& program, const std::string& log,
                          const std::vector<std::string>& options) const {
  std::vector<std::string> command = {"/usr/bin/env", "SLURM_CONF=" + config_,  program, "-D", "-f", config_,
                                      "-L",           place_.path(log).string()};
  command.insert(command.end(), options.begin(), options.end());
  return keeper_.start(command);
}

void SlurmCluster::lose_node(const std::string& node) {
  std::istringstream jobs(said("squeue -h -r -w " + node + " -o %A"));
  ::kill(nodes_[node], SIGKILL);  // first, so that it cannot report the end of the others
  const std::vector<Process> all = processes();
  for (std::string job; jobs >> job;)
    for (const Process& process : all)
      if (process.command.rfind("slurmstepd: [" + job + ".", 0) == 0) ::kill(process.id, SIGKILL);
  shell(place_, "scontrol update nodename=" + node + " state=down reason=lost");
}

void SlurmCluster::return_node(const std::string& node) {
  nodes_[node] = start(node_program_, node + ".log", {"-N", node});
}

}  // namespace relign::cluster_test
