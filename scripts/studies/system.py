"""Debian's packages that studies and comparisons take."""

import os
import subprocess


def install(*packages):
    """Installs what is missing, as root."""

    def there(name):
        shown = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status}", name], capture_output=True, text=True)
        return shown.stdout == "installed"

    missing = [name for name in packages if not there(name)]
    if not missing:
        return
    if os.geteuid() != 0:
        raise SystemExit(f"these packages are missing, and only root can install them: {' '.join(missing)}")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run(["apt-get", "update", "-qq"], check=True, env=environment)
    words = ["apt-get", "install", "--yes", "--no-install-recommends", "-qq", "-o", "DPkg::Lock::Timeout=300", *missing]
    subprocess.run(words, check=True, env=environment, stdout=subprocess.DEVNULL)
