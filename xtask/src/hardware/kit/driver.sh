# Libraries, Vulkan drivers and the choice of the adapter. Sourced by run.sh.
# shellcheck shell=bash
# shellcheck disable=SC2034,SC2154 # run.sh sets and reads variables of this file.

known_libraries=$(PATH=$PATH:/usr/sbin:/sbin ldconfig -p 2>/dev/null)
standard_manifests=(/etc/vulkan/icd.d /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d)
# Driver mounts outside the standard locations.
driver_places=(/usr/local/nvidia /opt /usr/lib /usr/lib64)

# True if the dynamic linker finds a library without help.
system_has() { [[ $known_libraries == *"$1 ("* ]]; }

add_library_folder() { export LD_LIBRARY_PATH=${LD_LIBRARY_PATH:+$LD_LIBRARY_PATH:}$1; }

# Links the kit's libraries that this machine lacks. An installed library suits its driver better.
lend_libraries() {
    local library lent=()
    mkdir -p "$work/lent"
    for library in "$work"/lib/*; do
        if [[ -e $library ]] && ! system_has "${library##*/}"; then
            ln -s "$library" "$work/lent/"
            lent+=("${library##*/}")
        fi
    done
    ((${#lent[@]} > 0)) || return 0
    add_library_folder "$work/lent"
    say "libraries provided: ${lent[*]}"
}

# Paths of at most 50 files that match a name pattern, in the driver mounts.
find_in_places() {
    timeout 10 find -L "${driver_places[@]}" -maxdepth 6 "$@" 2>/dev/null | head -n 50
}

# Lets the dynamic linker find NVIDIA's driver if it is mounted outside the linker's folders.
find_driver_libraries() {
    local folder
    nvidia_libraries=()
    if system_has libGLX_nvidia.so.0; then
        nvidia_libraries+=(libGLX_nvidia.so.0)
    fi
    if system_has libEGL_nvidia.so.0; then
        nvidia_libraries+=(libEGL_nvidia.so.0)
    fi
    ((${#nvidia_libraries[@]} == 0)) || return 0
    # A folder of libraries for another word size is harmless: the linker skips them.
    while read -r folder; do
        add_library_folder "$folder"
        nvidia_libraries=(libGLX_nvidia.so.0 libEGL_nvidia.so.0)
        say "driver libraries: $folder"
    done < <(find_in_places '(' -name libGLX_nvidia.so.0 -o -name libEGL_nvidia.so.0 ')' -printf '%h\n' | sort -u)
}

list_adapters() { timeout --kill-after=5 60 "$program" info --adapters </dev/null 2>"$work/adapters.err"; }

# True if a list of adapters has one other than software.
has_hardware() { grep -E '^ +kind ' <<<"$1" | grep -qvE '^ +kind +Cpu,'; }

# Lists adapters with these manifests, joined by colons. Keeps the manifests if they provide a graphics card.
try_manifests() {
    local list
    # Loaders before 1.3.207 only support the second name.
    list=$(VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1 list_adapters) || return 1
    has_hardware "$list" || return 1
    export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1
    adapters=$list
    say "Vulkan driver: $1"
}

# Searches for a driver that the loader does not find.
look_for_driver() {
    local manifests library manifest
    manifests=$(find_in_places -path '*vulkan*' -name '*.json' -path '*icd*' | sort | paste -s -d : -)
    [[ -n $manifests ]] && try_manifests "$manifests" && return 0
    # A container may have the driver's library without its manifest.
    for library in ${nvidia_libraries[@]+"${nvidia_libraries[@]}"}; do
        manifest=$work/$library.json
        printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.3.0"}}\n' "$library" \
            >"$manifest"
        try_manifests "$manifest" && return 0
    done
    return 1
}

# Sets $adapter to gpu, or to cpu if software is allowed. Fails without a graphics card if it is not.
choose_adapter() {
    adapters=$(list_adapters)
    adapter=gpu
    export LANTERNFISH_TEST_ADAPTER=gpu
    if ! has_hardware "$adapters" && ! look_for_driver; then
        if [[ -z $allow_software || -z $adapters ]]; then
            no_hardware >&2
            return 1
        fi
        adapter=cpu
        unset LANTERNFISH_TEST_ADAPTER
    fi
    printf '%s\n' "$adapters"
    adapter_names=$(sed -n 's/^adapter  *//p' <<<"$adapters" | paste -s -d , -)
}

# Reports prominently that there is no graphics card, and lists the adapters.
no_hardware() {
    local bar='######################################################################'
    local what='ONLY A SOFTWARE ADAPTER WAS FOUND'
    [[ -n $adapters ]] || what='NO ADAPTER WAS FOUND'
    printf '\n%s\n#  %-64s  #\n' "$bar" "$what"
    printf '#  %-64s  #\n' 'Nothing was run: results of software say nothing about hardware.' \
        '--allow-software runs it anyway.'
    printf '%s\n\nadapters:\n%s\n' "$bar" "${adapters:-none}"
    printf '\nwhat the Vulkan loader says:\n'
    VK_LOADER_DEBUG=error,warn timeout 60 "$program" info --adapters 2>&1 >/dev/null </dev/null | tail -n 20
    printf '\nmanifests:\n'
    ls -l "${standard_manifests[@]}" 2>&1
    find_in_places -path '*vulkan*' -name '*.json'
    printf '\ndevices and libraries:\n'
    ls -d /dev/nvidia* /dev/dri/* /dev/dxg 2>/dev/null
    grep -E 'libvulkan|_nvidia\.so|libcuda\.so' <<<"$known_libraries"
    printf 'LD_LIBRARY_PATH=%s\n' "${LD_LIBRARY_PATH:-}"
}
