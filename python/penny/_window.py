"""A window that shows pictures and says what is done to it: the process behind `viewer.launch_passive`.

    python -m penny._window WIDTH HEIGHT

Standard input: pictures, each as four bytes with its length (big-endian) and a PPM file; at its end the window closes.
Standard output, a line each: `shown` (the last picture), `size W H`, `rotate X Y` and `pan X Y` (parts of the height),
`zoom N` (notches of the wheel), `key CODE` (GLFW's).
"""

from __future__ import annotations

import queue
import struct
import sys
import threading

# GLFW's codes of keys that are no character.
KEYS = {
    "space": 32, "Escape": 256, "Return": 257, "Tab": 258, "BackSpace": 259, "Insert": 260, "Delete": 261, "Right": 262,
    "Left": 263, "Down": 264, "Up": 265, "Prior": 266, "Next": 267, "Home": 268, "End": 269,
    **{f"F{n}": 289 + n for n in range(1, 13)},
}  # fmt: skip
# How often the window looks for a picture, ms: more often than any screen shows one.
LOOK = 4


def say(*words) -> None:
    print(*words, flush=True)


def read(pictures: queue.Queue) -> None:
    """Pictures from standard input; `None` at its end."""
    source = sys.stdin.buffer
    while len(head := source.read(4)) == 4:
        pictures.put(source.read(struct.unpack(">I", head)[0]))
    pictures.put(None)


def main(width: int, height: int) -> None:
    import tkinter

    root = tkinter.Tk()
    root.title("Penny")
    root.geometry(f"{width}x{height}")
    label = tkinter.Label(root, borderwidth=0)
    label.pack(fill="both", expand=True)
    pictures: queue.Queue = queue.Queue()
    threading.Thread(target=read, args=(pictures,), daemon=True).start()
    size, at = [width, height], [0, 0]

    def look():
        if not pictures.empty():
            picture = pictures.get()
            if picture is None:
                root.destroy()
                return
            # Kept: Tk shows no image that nobody holds.
            label.image = tkinter.PhotoImage(data=picture, format="PPM")
            label.configure(image=label.image)
            say("shown")
        root.after(LOOK, look)

    def press(event):
        at[:] = event.x, event.y

    def drag(what):
        def moved(event):
            say(what, (event.x - at[0]) / size[1], (event.y - at[1]) / size[1])
            press(event)

        return moved

    def resize(event):
        if event.widget is root and [event.width, event.height] != size and min(event.width, event.height) > 1:
            size[:] = event.width, event.height
            say("size", *size)

    def key(event):
        code = KEYS.get(event.keysym, ord(event.char.upper()) if event.char.isprintable() and event.char else 0)
        if code:
            say("key", code)

    for button, what in ((1, "rotate"), (2, "pan"), (3, "pan")):
        root.bind(f"<ButtonPress-{button}>", press)
        root.bind(f"<B{button}-Motion>", drag(what))
    root.bind("<MouseWheel>", lambda event: say("zoom", event.delta / 120))
    root.bind("<Button-4>", lambda _: say("zoom", 1))
    root.bind("<Button-5>", lambda _: say("zoom", -1))
    root.bind("<Key>", key)
    root.bind("<Configure>", resize)
    say("shown")
    root.after(LOOK, look)
    root.mainloop()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
