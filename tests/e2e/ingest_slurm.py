"""The guide's lines for Slurm, run by a real one of one machine: shards as an array of jobs, and a merge that waits for them."""
# label: slow
# timeout: 300
import contextlib
import os
import pathlib
import pwd
import re
import shutil
import socket
import subprocess
import time
import unittest

from osgeo import gdal

from _common import EVEREST, PROGRAM, ROOT, Case, shared
from _services import free_port

GUIDE = (ROOT / "docs/preparing-data.md").read_text()
SYSTEM_PATH = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"


class Slurm:
    """munged, slurmctld and slurmd on loopback, with all that they write in a folder; ended with the test."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True)
        self.host = socket.gethostname().split(".")[0]
        self.programs = []
        user = pwd.getpwuid(os.geteuid()).pw_name
        key = self.folder / "key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        (self.folder / "slurm.conf").write_text(f"""ClusterName=tellurion
SlurmctldHost={self.host}(127.0.0.1)
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={self.folder}/munge.socket
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName={self.host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        self.environment = os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": f"{pathlib.Path(PROGRAM).parent}:{SYSTEM_PATH}",
                                         "XDG_CACHE_HOME": str(self.folder / "cache")}
        self.start("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.folder}/munge.socket", f"--pid-file={self.folder}/munged.pid",
                   f"--seed-file={self.folder}/munged.seed", "--num-threads=2")
        self.wait_for(lambda: (self.folder / "munge.socket").exists(), "munged")
        self.start("slurmctld", "-D")
        self.start("slurmd", "-D", "-N", self.host)
        self.wait_for(lambda: "idle" in self.said("sinfo", "--noheader", "--format=%T"), "Slurm's node")

    def start(self, name, *options):
        program = shutil.which(name, path=SYSTEM_PATH)
        if not program:
            raise RuntimeError(f"{name} is missing: tools/setup.sh --test installs it")
        with open(self.folder / f"{name}.log", "w") as log:
            self.programs.append(subprocess.Popen([program, *options], stdout=log, stderr=subprocess.STDOUT, env=self.environment))

    def said(self, *command):
        return subprocess.run(command, capture_output=True, text=True, env=self.environment, timeout=60).stdout

    def wait_for(self, there, what):
        for _ in range(300):
            if there():
                return
            time.sleep(0.1)
        self.close()
        raise RuntimeError(f"{what} did not come up\n" + "\n".join(log.read_text()[-2000:] for log in self.folder.glob("*.log")))

    def close(self):
        for program in reversed(self.programs):
            program.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(10)
            program.kill()
            program.wait()


class IngestSlurm(Case):
    def test_the_guides_lines_make_what_one_run_makes(self):
        (self.folder / "dem").mkdir()
        dem = gdal.Translate(str(self.folder / "dem/fine.tif"), str(shared(EVEREST)), widthPct=400, heightPct=400, resampleAlg="bilinear")
        self.assertGreater(dem.RasterXSize, 3000)
        dem.FlushCache()
        lines = [line.strip() for line in GUIDE.splitlines() if "sbatch" in line]
        self.assertEqual(len(lines), 2)
        slurm = Slurm(self.folder / "slurm")
        self.addCleanup(slurm.close)
        script = "set -e\n" + "\n".join(lines)
        done = subprocess.run(["bash", "-c", script], cwd=self.folder, capture_output=True, text=True, timeout=240, env=slurm.environment)
        logs = "\n".join(file.read_text()[-500:] for file in sorted(self.folder.glob("slurm-*.out")))
        self.assertEqual(done.returncode, 0, done.stderr + logs + slurm.said("squeue"))
        shards = re.findall(r"shard (\d)/4, (\d+) of", logs)
        self.assertEqual({shard for shard, _ in shards}, {"1", "2", "3", "4"}, logs)
        self.assertGreaterEqual(sum(int(made) > 0 for _, made in shards), 2, "the work was shared")
        self.tellurion("ingest", self.folder / "dem", "--out", self.folder / "one.tif")
        self.assertEqual((self.folder / "slurm.tif").read_bytes(), (self.folder / "one.tif").read_bytes())


if __name__ == "__main__":
    unittest.main()
