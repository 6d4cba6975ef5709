#!/usr/bin/env python3
"""Builds the wheel lanternfish-lavapipe: Mesa's software driver for Vulkan and a Vulkan loader, for glibc 2.28.

Run as root on Debian or Ubuntu (needs debootstrap, pip, 3 GB of disk):

    python3 build.py OUT [--root FOLDER] [--mesa TARBALL]

All compilers and libraries are those of a chroot of Debian stable, which is made if it is missing. What is linked:

- LLVM, libstdc++, zlib and zstd from Debian's static archives, so that the driver needs only glibc;
- link-time copies of glibc 2.28's libraries, which hold no code, only names and versions. They come with zig;
- compat.c, for the functions that newer headers and those archives need and glibc 2.28 lacks.
"""

import argparse
import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
import zipfile
from pathlib import Path

SUITE = "trixie"
MESA = "26.0.8"
# The same file: where Mesa publishes it, and in a distribution's archive, for when the first does not answer.
MESA_URLS = (
    f"https://archive.mesa3d.org/mesa-{MESA}.tar.xz",
    f"http://archive.ubuntu.com/ubuntu/pool/main/m/mesa/mesa_{MESA}.orig.tar.xz",
)
MESA_SHA256 = "caf1c0061a68e88dfa74967a7e780c0e85d65b6c4e334cd69095a5dc54ad78bc"
LLVM = 22
ZIG = "0.15.2"
GLIBC = (2, 28)

PACKAGES = f"""g++ meson ninja-build cmake pkgconf bison flex glslang-tools dpkg-dev xz-utils libvulkan-dev
    llvm-{LLVM}-dev libzstd-dev zlib1g-dev python3-mako python3-yaml python3-packaging python3-setuptools""".split()
# What the driver and the loader may need at run time: parts of glibc.
GLIBC_LIBRARIES = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "ld-linux-x86-64.so.2"}

LIBRARY = "vulkan_lanternfish"
LAVAPIPE = "src/gallium/targets/lavapipe"  # in the folders of Mesa's source and build

# Only the entry points of the driver are exported: symbols of LLVM and libstdc++ must not meet those of the process.
EXPORTS = "{ global: vk_icd*; local: *; };"
# The linker takes this for glibc. An archive's member is linked only if glibc 2.28 lacks what it defines.
LIBC = """GROUP ( /stubs/libc.so.6 /stubs/libpthread.so.0 /stubs/libdl.so.2 /stubs/libcompat.a
    /usr/lib/x86_64-linux-gnu/libc_nonshared.a AS_NEEDED ( /lib64/ld-linux-x86-64.so.2 ) )"""
LINK = "-L/stubs -static-libgcc -static-libstdc++ -Wl,--gc-sections -Wl,-O1"
COMPILE = "-ffunction-sections -fdata-sections"

MESA_OPTIONS = """--buildtype=release -Db_ndebug=true --native-file=/src/llvm.ini
    -Dvulkan-drivers=swrast -Dgallium-drivers=llvmpipe -Dplatforms= -Dvideo-codecs=
    -Dglx=disabled -Degl=disabled -Dgbm=disabled -Dopengl=false -Dgles1=disabled -Dgles2=disabled
    -Dllvm=enabled -Dshared-llvm=disabled -Dzlib=enabled -Dzstd=enabled -Dexpat=disabled
    -Dxmlconfig=disabled -Dspirv-tools=disabled -Dvalgrind=disabled -Dlibunwind=disabled -Dlmsensors=disabled
    -Ddisplay-info=disabled""".split()
LOADER_OPTIONS = """-DCMAKE_BUILD_TYPE=Release -DSYSCONFDIR=/etc -DBUILD_TESTS=OFF -DLOADER_CODEGEN=ON
    -DVULKAN_HEADERS_INSTALL_DIR=/usr -DBUILD_WSI_XCB_SUPPORT=OFF -DBUILD_WSI_XLIB_SUPPORT=OFF
    -DBUILD_WSI_XLIB_XRANDR_SUPPORT=OFF -DBUILD_WSI_WAYLAND_SUPPORT=OFF""".split()

# The text of each licence in the wheel, by its path in the chroot.
LICENSES = {
    "mesa.rst": "src/mesa/docs/license.rst",
    "mesa-MIT.txt": "src/mesa/licenses/MIT",
    "llvm.txt": f"usr/share/doc/llvm-{LLVM}-dev/copyright",
    "libstdc++-libgcc.txt": "usr/share/doc/gcc-14-base/copyright",
    "zlib.txt": "usr/share/doc/zlib1g-dev/copyright",
    "zstd.txt": "usr/share/doc/libzstd-dev/copyright",
    "vulkan-loader.txt": "src/loader/LICENSE.txt",
    "GPL-3.txt": "usr/share/common-licenses/GPL-3",
    "Apache-2.0.txt": "usr/share/common-licenses/Apache-2.0",
}
LICENSE = (
    "MIT AND Apache-2.0 WITH LLVM-exception AND Apache-2.0 AND Zlib AND BSD-3-Clause AND GPL-3.0-or-later WITH "
    "GCC-exception-3.1"
)

HERE = Path(__file__).resolve().parent


def run(*command, **options):
    print("+", *command, file=sys.stderr, flush=True)
    return subprocess.run([str(word) for word in command], check=True, **options)


class Root:
    """The chroot: Debian's compilers and libraries, and the sources under /src."""

    def __init__(self, path: Path):
        self.path = path
        mirror = debian_mirror()
        if not (path / "usr/bin/apt-get").exists():
            run("debootstrap", "--variant=minbase", "--include=ca-certificates", SUITE, path, mirror)
        self.write("etc/apt/sources.list", f"deb {mirror} {SUITE} main\ndeb-src {mirror} {SUITE} main\n")
        self.write("etc/apt/apt.conf.d/99-build", 'APT::Install-Recommends "false";\nAPT::Sandbox::User "root";\n')
        self.sh("apt-get update -q && apt-get install -y -q " + " ".join(PACKAGES))

    def sh(self, script: str):
        # Both file systems live in a mount namespace of the command's own, so nothing stays mounted.
        inside = f"mount -t proc proc {self.path}/proc && mount --bind /dev {self.path}/dev && exec chroot {self.path} "
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
        run("unshare", "--mount", "sh", "-ec", inside + 'sh -ec "$1"', "sh", script, env=environment)

    def write(self, path: str, text: str):
        (self.path / path).write_text(text)


def debian_mirror() -> str:
    """The mirror of Debian that this machine uses, or the public one."""
    files = [Path("/etc/apt/sources.list"), *Path("/etc/apt/sources.list.d").glob("*")]
    text = "\n".join(file.read_text() for file in files if file.is_file())
    found = re.search(r"^(?:URIs:|deb\s(?:\[.*?\])?)\s*(\S+/debian)/?(?:\s|$)", text, re.MULTILINE)
    return found[1] if found else "http://deb.debian.org/debian"


def make_stubs(root: Root):
    """Fills /stubs with what the linker takes for glibc."""
    stubs = root.path / "stubs"
    shutil.rmtree(stubs, ignore_errors=True)
    stubs.mkdir()
    with tempfile.TemporaryDirectory() as folder:
        run(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", folder, f"ziglang=={ZIG}")
        (Path(folder) / "empty.c").write_text("int main(void) { return 0; }\n")
        target = "x86_64-linux-gnu." + ".".join(map(str, GLIBC))
        zig = [f"{folder}/ziglang/zig", "cc", "-target", target, "empty.c", "-o", "empty"]
        run(*zig, cwd=folder, env={**os.environ, "ZIG_GLOBAL_CACHE_DIR": f"{folder}/cache"})
        for stub in Path(folder).glob("cache/o/*/lib*.so.*"):
            shutil.copy(stub, stubs)
            (stubs / (stub.name.split(".so")[0] + ".so")).symlink_to(stub.name)
    (stubs / "libc.so").unlink()
    root.write("stubs/libc.so", LIBC)
    root.write("stubs/exports.map", EXPORTS)
    shutil.copy(HERE / "compat.c", stubs)
    root.sh(
        "cd /stubs && gcc -O2 -fPIC -fvisibility=hidden -Wall -Wextra -ffunction-sections -c compat.c "
        "&& ar rcs libcompat.a compat.o "
        # llvm-config names Polly, an optimiser that Mesa never calls: empty archives satisfy the linker.
        "&& ar rcs libPolly.a && ar rcs libPollyISL.a "
        # Without these links -lz and -lzstd are the static archives.
        "&& rm -f /usr/lib/x86_64-linux-gnu/libz.so /usr/lib/x86_64-linux-gnu/libzstd.so"
    )


def download(urls: tuple[str, ...]) -> bytes:
    """What the first of `urls` that answers holds."""
    for url in urls:
        try:
            return urllib.request.urlopen(url, timeout=60).read()
        except OSError as error:
            print(f"{url}: {error}", file=sys.stderr)
    sys.exit(f"none of {len(urls)} addresses of Mesa {MESA} answers: give its tarball by --mesa")


def mesa_tarball(given: Path | None) -> bytes:
    data = given.read_bytes() if given else download(MESA_URLS)
    digest = hashlib.sha256(data).hexdigest()
    if digest != MESA_SHA256:
        sys.exit(f"the tarball of Mesa {MESA} has SHA-256 {digest}, expected {MESA_SHA256}")
    return data


def build_driver(root: Root, tarball: bytes):
    (root.path / "src/mesa.tar.xz").write_bytes(tarball)
    root.write("src/llvm.ini", f"[binaries]\nllvm-config = '/usr/bin/llvm-config-{LLVM}'\n")
    link = f"{LINK} -Wl,--version-script=/stubs/exports.map"
    flags = [f"-D{language}_args={COMPILE}" for language in ("c", "cpp")]
    flags += [f"-D{language}_link_args={link}" for language in ("c", "cpp")]
    options = " ".join(f"'{option}'" for option in [*MESA_OPTIONS, *flags])
    root.sh(
        "cd /src && rm -rf mesa mesa-build && mkdir mesa && tar -C mesa --strip-components=1 -xf mesa.tar.xz "
        # Mesa asks for libdrm on every Linux, though a driver without windows and devices calls none of it. One file
        # lacks the header then.
        "&& cd mesa && sed -i \"/^system_has_kms_drm/s/'linux', //\" meson.build "
        "&& sed -i '/lvp_private.h/a #include \"drm-uapi/drm_fourcc.h\"' src/gallium/frontends/lavapipe/lvp_formats.c "
        # With a SONAME of its own it can be loaded beside the system's lavapipe.
        f"&& sed -i \"s/'vulkan_lvp'/'{LIBRARY}'/\" {LAVAPIPE}/meson.build "
        f"&& meson setup /src/mesa-build {options} && cd /src/mesa-build "
        f"&& ninja {LAVAPIPE}/lib{LIBRARY}.so {LAVAPIPE}/lvp_icd.x86_64.json && strip {LAVAPIPE}/lib{LIBRARY}.so"
    )


def build_loader(root: Root):
    root.sh(
        "cd /src && rm -rf loader loader-build vulkan-loader-* && apt-get source -q vulkan-loader "
        "&& mv vulkan-loader-*/ loader && mkdir -p loader/loader/generated "
        f"&& cmake -G Ninja -S loader -B loader-build '-DCMAKE_SHARED_LINKER_FLAGS={LINK}' {' '.join(LOADER_OPTIONS)} "
        "&& ninja -C loader-build loader_codegen && ninja -C loader-build && strip loader-build/loader/libvulkan.so.1"
    )


def check(library: Path):
    """Fails if `library` needs a newer glibc, another library, or exports more than Vulkan."""
    dump = run("objdump", "-pT", library, capture_output=True, text=True).stdout
    needed = set(re.findall(r"NEEDED\s+(\S+)", dump))
    versions = {tuple(map(int, v.split("."))) for v in re.findall(r"\(?GLIBC_([0-9.]+)", dump)}
    exported = [line.split()[-1] for line in dump.splitlines() if re.match(r"[0-9a-f]{16} .*\s\.\w", line)]
    strange = [name for name in exported if not name.lower().startswith("vk")]
    if needed - GLIBC_LIBRARIES or max(versions) > GLIBC or strange:
        sys.exit(f"{library}: needs {sorted(needed)}, glibc {max(versions)}, exports {strange}")
    floor = ".".join(map(str, max(versions)))
    print(f"{library.name}: {library.stat().st_size:,} bytes, glibc {floor}, needs {' '.join(sorted(needed))}")


def write_wheel(root: Root, out: Path):
    lavapipe = root.path / "src/mesa-build" / LAVAPIPE
    driver, loader = lavapipe / f"lib{LIBRARY}.so", root.path / "src/loader-build/loader/libvulkan.so.1"
    check(driver)
    check(loader.resolve())
    manifest = (lavapipe / "lvp_icd.x86_64.json").read_text()
    manifest = re.sub(r'"library_path": "[^"]*"', '"library_path": "./libvulkan_lvp.so"', manifest)
    package, info = "lanternfish_lavapipe", f"lanternfish_lavapipe-{MESA}.dist-info"
    tag = "py3-none-manylinux_{}_{}_x86_64".format(*GLIBC)
    licenses = {f"{info}/licenses/{name}": (root.path / path).read_bytes() for name, path in LICENSES.items()}
    metadata = f"Metadata-Version: 2.4\nName: lanternfish-lavapipe\nVersion: {MESA}\n"
    metadata += "Summary: Mesa's software driver for Vulkan, and a loader, that need only glibc\n"
    metadata += f"License-Expression: {LICENSE}\n" + "".join(f"License-File: {name}\n" for name in LICENSES)
    metadata += "Requires-Python: >=3.8\nDescription-Content-Type: text/markdown\n\n" + (HERE / "README.md").read_text()
    files = {
        f"{package}/__init__.py": (HERE / package / "__init__.py").read_bytes(),
        f"{package}/lib/libvulkan_lvp.so": driver.read_bytes(),
        f"{package}/lib/libvulkan.so.1": loader.read_bytes(),
        f"{package}/lib/lvp_icd.json": manifest.encode(),
        **licenses,
        f"{info}/METADATA": metadata.encode(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: build.py\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
    }
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    out.mkdir(parents=True, exist_ok=True)
    wheel = out / f"{package}-{MESA}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
            archive.writestr(entry, data, compresslevel=9)
    print(f"{wheel}: {wheel.stat().st_size:,} bytes, {sum(map(len, files.values())):,} installed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="folder for the wheel")
    parser.add_argument("--root", type=Path, default=Path(f"/var/tmp/lanternfish-{SUITE}"), help="the chroot")
    parser.add_argument("--mesa", type=Path, help="Mesa's tarball, instead of a download")
    arguments = parser.parse_args()
    tarball = mesa_tarball(arguments.mesa)
    root = Root(arguments.root.resolve())
    (root.path / "src").mkdir(exist_ok=True)
    make_stubs(root)
    build_driver(root, tarball)
    build_loader(root)
    write_wheel(root, arguments.out)
    root.sh(f"cat /etc/debian_version; dpkg-query -W g++ libc6-dev llvm-{LLVM}-dev zlib1g-dev libzstd-dev")


if __name__ == "__main__":
    main()
