/* Judges photos through include/gonogo.h, as a stranger's program would: model, calibration, then files.
 * A file named *.raw is taken for grey pixels with 7 spare bytes a row. Prints a line of JSON a photo.
 * Before that it makes every mistake a caller can make, and expects an answer to each. */
#include "gonogo.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPECT(what) \
    do { \
        if (!(what)) { \
            fprintf(stderr, "line %d: not so: %s\n", __LINE__, #what); \
            exit(3); \
        } \
    } while (0)

struct file {
    uint8_t *data;
    size_t size;
};

static struct file read_file(const char *path) {
    struct file file = {NULL, 0};
    FILE *in = fopen(path, "rb");
    EXPECT(in != NULL);
    EXPECT(fseek(in, 0, SEEK_END) == 0);
    file.size = (size_t)ftell(in);
    rewind(in);
    file.data = malloc(file.size + 1);
    EXPECT(file.data != NULL && fread(file.data, 1, file.size, in) == file.size);
    fclose(in);
    return file;
}

/* The text must be one of the library's and hold `part`; it is given back. */
static void expect_text(gonogo_text *text, const char *part) {
    EXPECT(text->data != NULL && strlen(text->data) == text->size);
    if (strstr(text->data, part) == NULL) {
        fprintf(stderr, "`%s` is not in: %s\n", part, text->data);
        exit(3);
    }
    gonogo_text_free(text);
    EXPECT(text->data == NULL && text->size == 0);
}

static void mistakes(const gonogo_inspector *inspector, struct file model, struct file photo) {
    gonogo_text text = {NULL, 0};
    gonogo_inspector *none = (gonogo_inspector *)&text;
    uint32_t width = 0, height = 0;
    uint8_t pixels[16] = {0};
    gonogo_image image = {pixels, sizeof pixels, 4, 4, 4, GONOGO_GREY8};

    EXPECT(gonogo_open(model.data, model.size, NULL, 0, NULL, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "inspector");
    EXPECT(gonogo_open(NULL, 9, NULL, 0, &none, &text) == GONOGO_BAD_ARGUMENT && none == NULL);
    expect_text(&text, "model");
    EXPECT(gonogo_open(model.data, SIZE_MAX, NULL, 0, &none, NULL) == GONOGO_BAD_ARGUMENT && none == NULL);
    EXPECT(gonogo_open(model.data, 0, NULL, 0, &none, &text) == GONOGO_REFUSED && none == NULL);
    expect_text(&text, "E0803");
    EXPECT(gonogo_open(model.data, model.size / 2, NULL, 0, &none, &text) == GONOGO_REFUSED);
    expect_text(&text, "E0802");
    EXPECT(gonogo_open(model.data, model.size, photo.data, photo.size, &none, &text) == GONOGO_REFUSED);
    expect_text(&text, "E0803");

    EXPECT(gonogo_photo_size(NULL, &width, &height) == GONOGO_BAD_ARGUMENT);
    EXPECT(gonogo_photo_size(inspector, NULL, &height) == GONOGO_BAD_ARGUMENT);
    EXPECT(gonogo_judge_file(NULL, "x", photo.data, photo.size, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "inspector");
    EXPECT(gonogo_judge_file(inspector, "x", NULL, 5, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "file");
    EXPECT(gonogo_judge_file(inspector, NULL, photo.data, photo.size / 2, &text) == GONOGO_CANNOT_INSPECT);
    expect_text(&text, "{\"photo\":\"\",\"verdict\":\"cannot-inspect\"");
    EXPECT(gonogo_judge_file(inspector, "\xff", photo.data, 0, NULL) == GONOGO_CANNOT_INSPECT);

    EXPECT(gonogo_judge_pixels(inspector, "x", NULL, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "image");
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_CANNOT_INSPECT);
    expect_text(&text, "E0804");
    EXPECT(gonogo_photo_size(inspector, &image.width, &image.height) == GONOGO_OK);
    image.stride = SIZE_MAX;
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_CANNOT_INSPECT);
    expect_text(&text, "too few");
    image.stride = 1;
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_CANNOT_INSPECT);
    expect_text(&text, "too few");
    image.stride = image.width;
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_CANNOT_INSPECT);
    expect_text(&text, "too few");
    image.format = 99;
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "99");
    image.format = GONOGO_RGB8;
    image.data = NULL;
    EXPECT(gonogo_judge_pixels(inspector, "x", &image, &text) == GONOGO_BAD_ARGUMENT);
    expect_text(&text, "data");

    EXPECT(gonogo_calibrate(model.data, model.size, photo.data, 3, &text) == GONOGO_REFUSED);
    expect_text(&text, "image");
    gonogo_text_free(NULL);
    gonogo_text_free(&text);
    gonogo_close(NULL);
}

static int32_t judge(const gonogo_inspector *inspector, const char *path, gonogo_text *verdict) {
    struct file file = read_file(path);
    const char *end = strrchr(path, '.');
    int32_t code;
    if (end != NULL && strcmp(end, ".raw") == 0) {
        gonogo_image image = {file.data, file.size, 0, 0, 0, GONOGO_GREY8};
        EXPECT(gonogo_photo_size(inspector, &image.width, &image.height) == GONOGO_OK);
        image.stride = image.width + 7;
        code = gonogo_judge_pixels(inspector, path, &image, verdict);
    } else {
        code = gonogo_judge_file(inspector, path, file.data, file.size, verdict);
    }
    free(file.data);
    return code;
}

int main(int argc, char **argv) {
    gonogo_inspector *inspector = NULL;
    gonogo_text text = {NULL, 0};
    struct file model, calibration, photo;
    int i, worst = 0;

    EXPECT(argc > 3 && gonogo_abi() == GONOGO_ABI && strlen(gonogo_version()) > 4);
    model = read_file(argv[1]);
    calibration = read_file(argv[2]);
    photo = read_file(argv[3]);
    EXPECT(gonogo_open(model.data, model.size, calibration.data, calibration.size, &inspector, &text) == GONOGO_OK);
    expect_text(&text, "");
    mistakes(inspector, model, photo);
    for (i = 3; i < argc; i++) {
        int32_t code = judge(inspector, argv[i], &text);
        EXPECT(code >= 0);
        worst = code > worst ? code : worst;
        puts(text.data);
        gonogo_text_free(&text);
    }

    /* Shown, a photo has boxes and scores, and its grey values are those that were judged. */
    {
        uint32_t width = 0, height = 0;
        uint8_t *grey;
        gonogo_text plain = {NULL, 0}, again = {NULL, 0};
        gonogo_image image = {NULL, 0, 0, 0, 0, GONOGO_GREY8};
        EXPECT(gonogo_photo_size(inspector, &width, &height) == GONOGO_OK);
        image.size = (size_t)width * height;
        image.stride = image.width = width;
        image.height = height;
        grey = malloc(image.size);
        image.data = grey;
        EXPECT(gonogo_show_file(inspector, "x", photo.data, photo.size, grey, image.size - 1, &text) == GONOGO_BAD_ARGUMENT);
        expect_text(&text, "grey");
        EXPECT(gonogo_show_file(inspector, "x", photo.data, photo.size / 2, grey, image.size, &text) == GONOGO_CANNOT_INSPECT);
        expect_text(&text, "\"decoded\":false");
        EXPECT(gonogo_show_file(inspector, "x", photo.data, photo.size, NULL, 0, NULL) == GONOGO_GO);
        EXPECT(gonogo_show_file(inspector, "x", photo.data, photo.size, grey, image.size, &text) == GONOGO_GO);
        EXPECT(gonogo_judge_file(inspector, "x", photo.data, photo.size, &plain) == GONOGO_GO);
        EXPECT(gonogo_judge_pixels(inspector, "x", &image, &again) == GONOGO_GO);
        EXPECT(strcmp(plain.data, again.data) == 0 && strncmp(text.data, plain.data, plain.size - 1) == 0);
        expect_text(&text, "\"decoded\":true");
        gonogo_text_free(&plain);
        gonogo_text_free(&again);
        free(grey);
    }

    /* The same calibration as the command line's, byte for byte. */
    EXPECT(gonogo_calibrate(model.data, model.size, photo.data, photo.size, &text) == GONOGO_OK);
    EXPECT(text.size == calibration.size && memcmp(text.data, calibration.data, text.size) == 0);
    gonogo_text_free(&text);
    gonogo_close(inspector);
    free(model.data);
    free(calibration.data);
    free(photo.data);
    return worst;
}
