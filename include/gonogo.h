/* gonogo: judges photos of assemblies with a model file that the gonogo compiler made.
 *
 * The library keeps no state of its own but the inspectors it hands out, opens no file, starts no thread and knows no clock.
 * An inspector may be used by several threads at once; opening, judging and closing are independent of each other.
 * Null pointers and sizes that do not fit are answered with GONOGO_BAD_ARGUMENT.
 *
 *     cargo rustc --release --lib --no-default-features --features c --crate-type staticlib
 *     cc main.c -Iinclude target/release/libgonogo.a -lm -lpthread -ldl
 */
#ifndef GONOGO_H
#define GONOGO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The meaning of the functions below; compare it with gonogo_abi(). */
#define GONOGO_ABI 1

/* What functions return. Whatever is not 0 is not go. */
enum {
    GONOGO_OK = 0,
    /* Verdicts, as the exit codes of `gonogo inspect`. */
    GONOGO_GO = 0,
    GONOGO_NO_GO = 1,
    GONOGO_CANNOT_INSPECT = 2,
    /* A pointer is null, or a number has no meaning. */
    GONOGO_BAD_ARGUMENT = -1,
    /* The model, the calibration or the photo to calibrate with is refused; the text says why. */
    GONOGO_REFUSED = -2,
    /* A fault of the library. Nothing was judged; the inspector may still be used. */
    GONOGO_INTERNAL = -3
};

/* How pixels lie in memory. Full scale is 255, or 65535 in the machine's byte order: values of a 12-bit camera are to be
 * shifted up by four bits. */
enum {
    GONOGO_GREY8 = 1,
    GONOGO_GREY16 = 2,
    GONOGO_RGB8 = 3,
    GONOGO_BGR8 = 4,
    GONOGO_RGBA8 = 5
};

typedef struct gonogo_inspector gonogo_inspector;

/* A text of the library's: UTF-8 with a zero after its end, to be given back by gonogo_text_free.
 * Functions overwrite it without freeing what it held. */
typedef struct gonogo_text {
    char *data;
    size_t size; /* without the zero */
} gonogo_text;

/* Pixels of the caller's, top row first. */
typedef struct gonogo_image {
    const uint8_t *data;
    size_t size;   /* bytes that may be read from data */
    size_t stride; /* bytes from one row to the next */
    uint32_t width, height;
    uint32_t format; /* GONOGO_GREY8 and so on */
} gonogo_image;

uint32_t gonogo_abi(void);
/* "0.1.0": never to be freed. */
const char *gonogo_version(void);

/* Reads a model and its calibration; `calibration` may be null, and then camera and lamps are taken to be as the spec says.
 * `*inspector` is null unless GONOGO_OK is returned. `message`, if not null, gets the reason of a failure, or "". */
int32_t gonogo_open(const uint8_t *model, size_t model_size, const uint8_t *calibration, size_t calibration_size,
                    gonogo_inspector **inspector, gonogo_text *message);
void gonogo_close(gonogo_inspector *inspector);

/* The size that photos must have, in px. */
int32_t gonogo_photo_size(const gonogo_inspector *inspector, uint32_t *width, uint32_t *height);

/* Judge an image file (PNG, JPEG, TIFF or BMP of 8 or 16 bits) or pixels in memory. `name` is what the verdict calls the
 * photo; it may be null. `verdict`, if not null, gets the line of JSON that `gonogo inspect --format json` prints
 * ("milliseconds" is null: the caller has the clock), or the reason where the result is negative. */
int32_t gonogo_judge_file(const gonogo_inspector *inspector, const char *name, const uint8_t *file, size_t file_size,
                          gonogo_text *verdict);
int32_t gonogo_judge_pixels(const gonogo_inspector *inspector, const char *name, const gonogo_image *image,
                            gonogo_text *verdict);

/* Judges an image file and shows it. `verdict` gets the same line with more keys at its end: "decoded", "locator_score",
 * "outline" (corners of the assembly's box, px) and "nodes" (of each: node, level, faulty, explained, fault, score, outline).
 * `grey`, if not null, has room for `grey_size` bytes, at least width times height of them: where "decoded" is true it gets the
 * photo's grey values as they were judged, 8 bits a pixel, top row first, upright. */
int32_t gonogo_show_file(const gonogo_inspector *inspector, const char *name, const uint8_t *file, size_t file_size,
                         uint8_t *grey, size_t grey_size, gonogo_text *verdict);

/* Fits a model to its station by an image file of a correct assembly. `calibration` gets the text of the calibration, or the
 * reason why the photo is refused. */
int32_t gonogo_calibrate(const uint8_t *model, size_t model_size, const uint8_t *photo, size_t photo_size,
                         gonogo_text *calibration);

/* Gives a text back and empties it; null and empty texts are fine. */
void gonogo_text_free(gonogo_text *text);

#ifdef __cplusplus
}
#endif

#endif
