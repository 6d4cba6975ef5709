"""Thumbnails of scene files, without a background: thumbnail.py FILE... writes FILE.png."""

import sys

import lanternfish as lf


def main(*paths: str) -> None:
    for path in paths:
        with lf.Renderer(lf.load(path), quality="draft", background="transparent", accumulate=4) as renderer:
            lf.write_png(f"{path.removeprefix('demo:')}.png", renderer.render(size=(256, 256), outputs="rgba")["rgba"])


if __name__ == "__main__":
    main(*sys.argv[1:])
