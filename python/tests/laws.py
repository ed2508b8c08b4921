"""Laws that other processes can import."""

import rumple


def growing(at):
    return {"c": at.k * at.area_strain - at.c}


def shrinking(at):
    return {"c": at.k * at.area_strain - 2 * at.c}


def failing(at):
    raise RuntimeError("on purpose")


def factor(at):
    return 1 + 0.1 * at.c


def law(rates):
    return rumple.Law(
        rates, "c", signals=["area_strain"], parameters={"k": 1.0}, length_factor=factor, name="growing"
    )


GROWING, SHRINKING, FAILING = law(growing), law(shrinking), law(failing)
