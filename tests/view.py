"""The page of `tetdb view` in a browser: first picture, cuts, a pick, a condition, keys alone; no complaint, nothing asked of others.

Usage: view.py TETDB STORE [PICTURE.png]    (PICTURE_cut.png, PICTURE_where.png and PICTURE_phone.png are written beside it)

Needs Playwright and a Chromium, whose program the variable CHROMIUM may name. Exit code 1: something is wrong.
"""

import os
import shutil
import signal
import subprocess
import sys

from playwright.sync_api import sync_playwright

from report import OPTIONS, differing, pixels, settle

# What the browser says of a refusal that was asked for.
REFUSED = "status of 400"


def ready(page, key, value=None):
    """Waits until the page notes something of itself."""
    # Not `wait_for_function`, whose code the policy of the page forbids.
    for _ in range(600):
        found = page.evaluate(f"document.body.dataset.{key} ?? null")
        if found is not None and value in (None, found):
            return settle(page)
        page.wait_for_timeout(100)
    status = page.locator("#status").inner_text() + page.locator("#answer").inner_text()
    raise AssertionError(f"the page has no {key}; it says {status!r}")


def cut(page, act):
    """Does something that moves the plane, and waits for the section."""
    page.evaluate("delete document.body.dataset.cut")
    before = pixels(page)
    act()
    ready(page, "cut")
    assert differing(before, pixels(page)) > 0.005, "the cut changes nothing"
    return page.locator("#status").inner_text()


def by_keys(page):
    """The same by keys alone: turn, zoom, cut, move the plane, point at a tetrahedron, ask, hide a sub-domain."""
    page.locator("#canvas").focus()
    first = pixels(page)
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("+")
    settle(page)
    assert differing(first, pixels(page)) > 0.02, "keys do not turn the view"
    page.keyboard.press("Home")
    settle(page)
    assert differing(first, pixels(page)) < 0.001, "Home does not bring the first view back"
    names = []
    for _ in range(60):
        page.keyboard.press("Tab")
        names.append(page.evaluate("document.activeElement.name || document.activeElement.id || document.activeElement.className"))
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline != "none" or names[-1] == "", f"{names[-1]} does not show that it has the focus"
        if names[-1] == "axis":
            cut(page, lambda: page.keyboard.press("ArrowRight"))
        elif names[-1] == "place":
            cut(page, lambda: page.keyboard.press("ArrowLeft"))
        elif names[-1] == "condition":
            page.keyboard.type("quality > 1.5")
            page.keyboard.press("Enter")
            ready(page, "answers")
            assert "tetrahedr" in page.locator("#answer").inner_text()
            page.locator("#forget").press("Enter")
            break
    missing = {"boundary", "axis", "place", "other", "color", "condition"} - set(names)
    assert not missing, f"the tabulator does not reach {missing}"
    page.locator("#canvas").focus()
    page.evaluate("delete document.body.dataset.pick")
    page.keyboard.press("Enter")
    ready(page, "pick")
    assert page.locator("#picked table").count() == 1, "Enter points at nothing"


def check(page, picture, said):
    ready(page, "view")
    assert page.evaluate("document.body.dataset.view") == "drawn", "the view in space was not drawn"
    ready(page, "surface", "complete")
    assert "token=" in page.url
    first = pixels(page)
    drawn = sum(first[i + 3] > 0 for i in range(0, len(first), 4)) / (len(first) // 4)
    assert drawn > 0.02, f"only {drawn:.1%} of the view is drawn"
    if picture:
        page.screenshot(path=picture, full_page=True)

    def check_axis(axis):
        return cut(page, lambda: page.check(f'input[name=axis][value="{axis}"]'))

    assert "tetrahedra" in check_axis("0")
    check_axis("1")
    check_axis("free")
    cut(page, lambda: page.locator("#facing").click())
    cut(page, lambda: page.locator("input[name=place]").fill("430"))
    cut(page, lambda: page.check("input[name=other]"))
    page.uncheck("input[name=other]")
    settle(page)
    options = page.locator("select[name=color] option").evaluate_all("all => all.map(o => o.value)")
    for color in ["quality", "T", "volume", "region"]:
        assert color in options, f"no color by {color}"
        before = pixels(page)
        page.select_option("select[name=color]", color)
        page.wait_for_timeout(1000)
        settle(page)
        assert differing(before, pixels(page)) > 0.005, f"color by {color} changes nothing"
    check_axis("0")
    page.select_option("select[name=color]", "quality")
    page.wait_for_timeout(1000)
    page.evaluate("delete document.body.dataset.pick")
    box = page.locator("#canvas").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    ready(page, "pick")
    words = page.locator("#picked").inner_text()
    for word in ["id", "sub-domain", "quality", "volume", "T"]:
        assert word in words, f"the tetrahedron has no {word}: {words}"
    if picture:
        page.screenshot(path=picture.replace(".png", "_cut.png"), full_page=True)
        page.emulate_media(color_scheme="dark", reduced_motion="reduce")
        settle(page)
        page.screenshot(path=picture.replace(".png", "_dark.png"), full_page=True)
        page.emulate_media(color_scheme="light")
    before = pixels(page)
    page.locator("#parts input").first.uncheck()
    settle(page)
    assert differing(before, pixels(page)) > 0.005, "a hidden sub-domain is still there"
    page.locator("#all").click()
    page.fill("#condition", "quality > 1.4 && T < 2")
    page.evaluate("delete document.body.dataset.answers")
    page.locator("#find").click()
    ready(page, "answers")
    assert "tetrahedr" in page.locator("#answer").inner_text()
    if picture:
        page.screenshot(path=picture.replace(".png", "_where.png"), full_page=True)
    assert not said, f"the browser complains: {said}"
    page.fill("#condition", "quality > six")
    page.locator("#find").click()
    page.wait_for_selector("#answer.bad")
    assert "six" in page.locator("#answer").inner_text(), page.locator("#answer").inner_text()
    page.locator("#forget").click()
    page.check('input[name=axis][value="none"]')
    page.select_option("select[name=color]", "subdomain")
    settle(page)
    assert differing(first, pixels(page)) < 0.02, "without cut and condition, the first picture does not come back"
    page.reload()
    ready(page, "surface", "complete")
    by_keys(page)


def main(tetdb, store, picture):
    program = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    server = subprocess.Popen([tetdb, "view", store, "--no-open"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    said, asked = [], []
    try:
        address = server.stdout.readline().strip()
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=program, args=OPTIONS)
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
            page.on("pageerror", lambda error: said.append(str(error)))
            page.on("request", lambda request: asked.append(request.url) if not request.url.startswith("data:") else None)
            page.goto(address)
            check(page, picture, said)
            first = page.evaluate("document.body.dataset.first")
            page.set_viewport_size({"width": 390, "height": 844})
            settle(page)
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert wide <= 390, f"a phone has to scroll sideways: {wide}"
            if picture:
                page.screenshot(path=picture.replace(".png", "_phone.png"), full_page=True)
            browser.close()
    finally:
        server.send_signal(signal.SIGINT)
        code = server.wait(timeout=30)
    origin = address.split("?")[0]
    strange = [url for url in asked if not url.startswith(origin)]
    said = [line for line in said if REFUSED not in line]
    assert not said, f"the browser complains: {said}"
    assert not strange, f"the page asks for {strange}"
    assert code == 0, f"the server ended with {code}"
    print(f"{store}: first picture after {first} ms; cut, colored, pointed at and asked, also by keys; the browser has nothing to complain of")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None)
