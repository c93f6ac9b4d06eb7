"""Fetches the policy's weights into the folder named: `install.py target/adapters/gpudrive`.

pip cannot build PufferLib's source distribution, and the weights lie in no wheel. So the distribution is fetched as it is from the package
index that pip is set to, checked, and only the weights and the licence are unpacked.
"""

import hashlib
import html.parser
import io
import os
import pathlib
import subprocess
import sys
import tarfile
import urllib.parse
import urllib.request

from pip._internal.models.index import PyPI

ARCHIVE = "pufferlib-3.0.0.tar.gz"
SHA256 = "7df3a3e3f5f894d78d2a1f5374097890aec01473183e748abefe4f3faa10eaa9"
WANTED = ("pufferlib-3.0.0/pufferlib/resources/gpudrive/gpudrive_weights.bin", "pufferlib-3.0.0/LICENSE")


class Links(html.parser.HTMLParser):
    """The addresses on an index's page."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attributes):
        self.found += [value for name, value in attributes if tag == "a" and name == "href"]


def index():
    """The package index that pip is set to."""
    asked = subprocess.run([sys.executable, "-m", "pip", "config", "get", "global.index-url"], capture_output=True, text=True)
    return os.environ.get("PIP_INDEX_URL") or asked.stdout.strip() or PyPI.simple_url


def fetch():
    page = index().rstrip("/") + "/pufferlib/"
    links = Links()
    with urllib.request.urlopen(page, timeout=60) as answer:
        links.feed(answer.read().decode())
    link = next((link for link in links.found if urllib.parse.urlparse(link).path.endswith("/" + ARCHIVE)), None)
    if link is None:
        sys.exit(f"install.py: {page} does not list {ARCHIVE}")
    with urllib.request.urlopen(urllib.parse.urljoin(page, link), timeout=300) as answer:
        return answer.read()


archive = fetch()
if hashlib.sha256(archive).hexdigest() != SHA256:
    sys.exit(f"install.py: {ARCHIVE} is not the one that this adapter was written for: its SHA-256 differs")
with tarfile.open(fileobj=io.BytesIO(archive)) as files:
    for name in WANTED:
        (pathlib.Path(sys.argv[1]) / pathlib.PurePosixPath(name).name).write_bytes(files.extractfile(name).read())
