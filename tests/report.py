"""The page of `tetdb report` in a browser: no complaint, nothing fetched, and a view that turns.

Usage: report.py PAGE.html [PICTURE.png]    (PICTURE_dark.png and PICTURE_turned.png are written beside it)

Needs Playwright and a Chromium, whose program the variable CHROMIUM may name. Exit code 1: something is wrong.
"""

import os
import pathlib
import shutil
import sys

from playwright.sync_api import sync_playwright

OPTIONS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


def pixels(page):
    """The colors of the view, thinned."""
    return page.evaluate(
        """() => {
            const canvas = document.getElementById('canvas'), gl = canvas.getContext('webgl2');
            const all = new Uint8Array(4 * canvas.width * canvas.height);
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, all);
            const some = [];
            for (let at = 0; at < all.length; at += 4 * 37) some.push(all[at], all[at + 1], all[at + 2], all[at + 3]);
            return some;
        }"""
    )


def differing(a, b):
    """Share of pixels that are not the same."""
    fours = range(0, len(a), 4)
    return sum(a[i : i + 4] != b[i : i + 4] for i in fours) / len(fours)


def settle(page):
    page.wait_for_timeout(200)
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def main(path, picture):
    program = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    address = pathlib.Path(path).resolve().as_uri()
    said, asked = [], []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=OPTIONS)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url) if not request.url.startswith("data:") else None)
        page.goto(address)
        page.wait_for_function("document.body.dataset.view !== undefined", timeout=60_000)
        assert page.evaluate("document.body.dataset.view") == "drawn", "the view in space was not drawn"
        settle(page)
        first = pixels(page)
        drawn = sum(first[i + 3] > 0 for i in range(0, len(first), 4)) / (len(first) // 4)
        assert drawn > 0.02, f"only {drawn:.1%} of the view is drawn"
        if picture:
            page.screenshot(path=picture, full_page=True)
            page.emulate_media(color_scheme="dark")
            page.screenshot(path=picture.replace(".png", "_dark.png"), full_page=True)
            page.emulate_media(color_scheme="light")

        box = page.locator("#canvas").bounding_box()
        middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 160, middle[1] + 60, steps=8)
        page.mouse.up()
        settle(page)
        turned = pixels(page)
        assert differing(first, turned) > 0.02, "the mouse does not turn the view"
        if picture:
            page.locator("#view").screenshot(path=picture.replace(".png", "_turned.png"))
        page.mouse.wheel(0, -400)
        settle(page)
        assert differing(turned, pixels(page)) > 0.02, "the wheel does not zoom"
        page.mouse.dblclick(*middle)
        settle(page)
        assert differing(first, pixels(page)) < 0.001, "a double click does not bring the first view back"
        for control, value in [("axis", "0"), ("axis", "2"), ("color", "quality"), ("color", "size")]:
            before = pixels(page)
            if control == "axis":
                if page.locator(f'input[name=axis][value="{value}"]').is_checked():
                    continue
                page.check(f'input[name=axis][value="{value}"]')
            else:
                page.select_option("select[name=color]", value)
            settle(page)
            assert differing(before, pixels(page)) > 0.005, f"{control} = {value} changes nothing"
        figures = page.locator("#figures b").all_inner_texts()
        browser.close()
    asked = [url for url in asked if url != address]
    assert not said, f"the browser complains: {said}"
    assert not asked, f"the page asks for {asked}"
    print(f"{path}: {figures[0]} tetrahedra; drawn, turned, zoomed, cut and colored; the browser has nothing to complain of")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None)
